"""Of what types the values in a domain file are; what the names mean is seen by the loader.

Called by `load` before anything is built; calls `reading`. Fields that are not named here are the
loader's to refuse, with the nearest known name.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StrictBool, StrictInt, ValidationError

from forestall.domain.located import keyed
from forestall.errors import InputError
from forestall.reading.models import sentence

MOST_TEXT = 4000
"""How many characters a text of a domain may have."""

Text = Annotated[str, Field(strict=True, max_length=MOST_TEXT)]
Texts = list[Text]
Number = Annotated[float, Field(strict=True, ge=-1e9, le=1e9)]
Flag = StrictBool


class _Table(BaseModel):
    model_config = ConfigDict(extra="allow", allow_inf_nan=False)


class _Effect(_Table):
    every: Texts = []
    when: Text = "true"
    then: Texts = []


class _Event(_Table):
    parameters: Texts = []
    effects: list[_Effect | Text] = []


class _Need(_Table):
    fact: Text = ""
    otherwise: Text = Field("", alias="else")
    lacks: Texts = []
    find: Text = ""


class _Choice(_Table):
    variable: Text = ""
    among: Texts = []
    such_that: Text = ""
    only_if: Text = ""
    otherwise: Text = Field("", alias="else")


class _Make(_Table):
    variable: Text = ""
    source: Text = ""
    by: Text = ""
    count: StrictInt | Text = 1


class _Skill(_Table):
    like: Text = ""
    parameters: Texts = []
    choices: list[_Choice] = []
    needs: list[_Need | Text] = []
    prefers: Texts = []
    effects: list[_Effect | Text] = []
    makes: list[_Make] = []
    at: Text | None = None
    drives: Flag = False
    hand: Text | None = None
    words: Text = ""
    says: Text = ""
    family: Text = ""
    undoes: Text = ""
    done_when: Text = ""
    duration_s: Number = 0.0


class _Process(_Table):
    parameters: Texts = []
    when: Text = ""
    effects: list[_Effect | Text] = []


class _Safety(_Table):
    never: Text = ""
    every: Texts = []
    when: Text = ""
    otherwise: Text = Field("", alias="else")


class _Predicate(_Table):
    kind: Text = ""
    parameters: Texts = []
    values: list[Any] = []
    camera: Flag = True
    contains: Flag = False
    group: Text | None = None
    symmetric: Flag = False
    mirrors: Text = ""
    scored: Flag = True
    geometry: Text = ""
    offered_by: Text = ""
    material: Flag = True
    mechanical: Flag = False
    in_hand: Flag = False
    fine: Flag = False
    obscures: Text = ""
    lasting: Flag = False
    paired: Text = ""
    mined: Flag = True
    definition: Text = ""
    words: Text = ""
    opposite: Text = ""
    says: dict[Text, Text] = {}
    phrases: dict[Text, Any] = {}
    by_category: dict[Text, dict[Text, Any]] = {}
    bins: list[Number] = []
    unit: Text = ""


class _Category(_Table):
    tags: Texts = []
    attributes: Texts = []
    defaults: dict[Text, Text] = {}
    aliases: Texts = []
    synonyms: Any = ()
    size_m: list[Annotated[Number, Field(gt=0, le=100)]] = Field([], max_length=3)
    world: dict[Text, Any] = {}


class _Robot(_Table):
    hands: Texts = []
    skills: Texts = []
    speed_m_per_s: Annotated[Number, Field(gt=0)] = 0.5


class _Domain(_Table):
    name: Text = ""
    tags: Texts = []
    roles: dict[Text, Texts | Text] = {}
    robot: _Robot = _Robot()
    predicates: dict[Text, _Predicate] = {}
    attributes: dict[Text, _Predicate] = {}
    categories: dict[Text, _Category] = {}
    events: dict[Text, _Event] = {}
    skills: dict[Text, _Skill] = {}
    processes: dict[Text, _Process] = {}
    safety: dict[Text, _Safety] = {}
    constants: dict[Text, Text] = {}
    spelling: dict[Text, Text] = {}
    run: dict[Text, Text] = {}


def check_shape(data: Mapping[str, Any]) -> None:
    """See that every value of a domain's tables is of its type.

    Raises:
        InputError: one is not; says where, and knows the header of its table.
    """
    try:
        _Domain.model_validate(data)
    except ValidationError as error:
        place = [str(key) for key in error.errors(include_url=False)[0]["loc"][:2]]
        raise keyed(InputError(sentence(error)), f"[{'.'.join(place)}]", f"[{place[0]}") from error
