"""What no senses can tell: the same look twice with something done in between."""

from __future__ import annotations

from dataclasses import replace

import pytest

from forestall.errors import ObservationError
from forestall.senses import Senses
from planning.episodes import OBSERVATION


def test_one_look_is_not_believed_again_after_something_was_done() -> None:
    senses = Senses(3)
    senses.check(OBSERVATION)
    senses.check(OBSERVATION)  # looking again, with nothing done
    senses.done(has_effect=False)
    senses.check(OBSERVATION)  # a drive to where the robot is takes no time and changes nothing
    senses.done(has_effect=True)
    with pytest.raises(ObservationError, match="look anew after each"):
        senses.check(OBSERVATION)
    again = replace(OBSERVATION, frames=(replace(OBSERVATION.frames[0]),))
    with pytest.raises(ObservationError, match="look anew after each"):
        senses.check(again)
    senses.check(replace(OBSERVATION, time_s=1.0))
