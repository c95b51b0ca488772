"""How often something has gone wrong in a row: alarms, repairs, failures.

Owned by the monitor, which holds the robot when it is too often; calls nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

from forestall.supervision import Limits
from forestall.types.decision import MonitorDecision, Outcome
from forestall.types.verdict import Decision


@dataclass(slots=True)
class Streaks:
    """What has gone wrong since something last went well."""

    alarms: int = 0
    repairs: int = 0
    failures: int = 0

    def after(self, decision: MonitorDecision, limits: Limits) -> str:
        """A moment was judged: what is too many now; a further look is no moment."""
        if decision.outcome is Outcome.LOOK:
            return ""
        verdict = decision.verdict
        if verdict is not None and verdict.decision is Decision.REPLAN:
            self.alarms += 1
        elif verdict is not None and verdict.judged:
            self.alarms = 0
        self.repairs += decision.outcome is Outcome.REPLAN
        return self.too_many(limits)

    def executed(self, succeeded: bool) -> None:
        """A subtask is over, as the robot knows it."""
        self.failures = 0 if succeeded else self.failures + 1
        if succeeded:
            self.repairs = 0

    def too_many(self, limits: Limits) -> str:
        """What has gone wrong more often than it may, in words; empty where nothing has."""
        for what, count, most in (
            ("alarms", self.alarms, limits.max_alarms_in_a_row),
            (
                "new plans without a success",
                self.repairs,
                limits.max_repairs_in_a_row,
            ),
            ("subtasks refused or failed", self.failures, limits.max_failures_in_a_row),
        ):
            if 0 < most < count:
                return f"{count} {what} in a row, and {most} are the most"
        return ""
