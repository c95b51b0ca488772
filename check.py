"""Every check of the project in one command: `python check.py`.

Formatting, linting, types, import contracts, tests. `python check.py tests -k memory` runs the
tests alone and hands the rest to pytest.
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


def main(arguments: list[str]) -> int:
    """Run the named check, or all; every one runs even when an earlier one failed."""
    chosen = {arguments[0]: CHECKS[arguments[0]]} if arguments else CHECKS
    failed = []
    for name, command in chosen.items():
        started = time.monotonic()
        print(f"== {name}", flush=True)
        done = subprocess.run([sys.executable, *command, *arguments[1:]], check=False)
        passed = done.returncode == 0
        seconds = time.monotonic() - started
        print(f"== {name}: {'ok' if passed else 'FAILED'} ({seconds:.0f} s)", flush=True)
        if not passed:
            failed.append(name)
    if not arguments:
        print("all checks passed" if not failed else f"failed: {', '.join(failed)}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
