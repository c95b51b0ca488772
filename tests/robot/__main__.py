"""Prints what became of every faulty run: `PYTHONPATH=tests python -m robot`, from the root."""

from __future__ import annotations

from robot.cases import CASES


def main() -> None:
    """Run all, one line each."""
    for case in CASES:
        played = case.play()
        record = played.record
        said = record.trouble.text if record.trouble else "; ".join(record.notes) or "went on"
        print(
            f"{case.name:48} {record.end.value:16} {played.seconds:5.2f} s "
            f"{played.after_fault:2} commands after it  {said}"
        )
    print(f"{len(CASES)} faulty runs")


if __name__ == "__main__":
    main()
