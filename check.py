"""Every check of the project in one command: `python check.py`.

Formatting, linting, types, import contracts, tests. `python check.py fast` leaves out the tests
that draw in the simulator or take long: the check before every commit. `python check.py tests -k
memory` runs the tests alone and hands the rest to pytest.
"""

import subprocess
import sys
import time

CHECKS = {
    "format": ["-m", "ruff", "format", "--check", "."],
    "lint": ["-m", "ruff", "check", "."],
    "types": ["-m", "mypy"],
    "imports": ["-c", "from importlinter.cli import lint_imports_command as run; run()"],
    "tests": ["-m", "pytest", "-n", "auto", "--dist", "loadgroup"],
}

FAST = {**CHECKS, "tests": [*CHECKS["tests"], "-m", "not slow and not simulator"]}


def main(arguments: list[str]) -> int:
    """Run the named check, or all; every one runs even when an earlier one failed."""
    name, *rest = arguments or ["all"]
    groups = {"all": CHECKS, "fast": FAST}
    checks = groups.get(name) or {name: CHECKS[name]}
    failed = []
    for check, command in checks.items():
        started = time.monotonic()
        print(f"== {check}", flush=True)
        done = subprocess.run([sys.executable, *command, *rest], check=False)
        passed = done.returncode == 0
        seconds = time.monotonic() - started
        print(f"== {check}: {'ok' if passed else 'FAILED'} ({seconds:.0f} s)", flush=True)
        if not passed:
            failed.append(check)
    if name in groups:
        print("all checks passed" if not failed else f"failed: {', '.join(failed)}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
