"""Every open choice of the paper's score (Eqs. 1-3) as a named option.

Read by the rest of this package; calls nothing. Why each default is what it is stands in
docs/decisions/0003-score-options.md.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum

from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError


class Feature(Enum):
    """What f(v) of Eq. 1 encodes."""

    TEXT = "text"  # one embedding of "category (states)"
    PARTS = "parts"  # an embedding of the category and one of the states, weighed apart
    IMAGE = "image"  # what an image encoder made of the node's crop; "parts" where one has none


class DegreeScale(Enum):
    """D of Eq. 3, by which a difference of degrees is divided."""

    LARGEST = "largest"  # the largest degree in the two graphs
    PAIR = "pair"  # the larger degree of the two matched nodes
    NODES = "nodes"  # one less than the number of nodes of the larger graph


class StructureCount(Enum):
    """N of Eq. 3, over which differences are averaged."""

    MATCHED = "matched"  # matched pairs
    UNION = "union"  # all nodes of both graphs, an unmatched one differing fully


class EmptyRule(Enum):
    """What a part is worth when both graphs have nothing for it to compare (0/0)."""

    ONE = "one"  # nothing expected, nothing there: full agreement
    SKIP = "skip"  # the part is left out of the mean


@dataclass(frozen=True, slots=True)
class ScoreConfig:
    """How two graphs are scored.

    Args:
        feature: what a node's feature encodes.
        state_weight: share of the states in the feature "parts".
        floor: a pair of nodes below this cosine stays unmatched. With "parts" and hashed words the
            same category scores 0.85 or more whatever its states, another one 0.8 or less; with
            "text" a lower floor is needed for changed states to match.
        image_floor: the same for two nodes with an image feature (feature "image"), where it alone
            decides, whatever their categories: a cup may match a mug that looks like it. Instance
            categories and known states that differ still keep nodes apart. Pairs of which one has
            no image feature (the gripper, what was never seen, supports compared as one category)
            are scored as "parts" has them, with `floor`. On development pictures of the shipped
            encoder 95 % of pairs of one category and state lie above 0.54, 95 % of pairs of two
            categories below 0.49.
        subtask_floor: the same for the two subtask nodes.
        state_changes_match: whether a node may match one of the same category whose known states
            differ; unobserved states agree with anything.
        ignored_attributes: states that do not count; None: those that no camera sees.
        subtask_node: whether the subtask node counts; it matches only the other subtask node.
        degree_scale: D.
        structure_count: N.
        predicates: relations that count; None: those that the domain scores.
        empty: what 0/0 is worth.
        generic_supports: categories in `supports` compare as one category "support".
        merge_supports: and all supports of a graph are one node, so that it does not matter which
            thing stands on which of them. Without effect unless `generic_supports`.
        supports: the categories meant by the two options above; None: the domain's supports.
        instance_categories: nodes of these categories match only when their numbers are equal or
            both are the same argument of their subtasks; None: the domain's numbered ones.
        use_node: ablation: whether S_node counts.
        use_edge: ablation: whether S_edge counts.
        use_structure: ablation: whether S_struc counts.

    Raises:
        InputError: a number out of range, an unknown name, or no part left.
    """

    feature: Feature = Feature.PARTS
    state_weight: float = 0.15
    floor: float = 0.8
    image_floor: float = 0.55
    subtask_floor: float = 0.6
    state_changes_match: bool = False
    ignored_attributes: tuple[str, ...] | None = None
    subtask_node: bool = True
    degree_scale: DegreeScale = DegreeScale.LARGEST
    structure_count: StructureCount = StructureCount.MATCHED
    predicates: tuple[str, ...] | None = None
    empty: EmptyRule = EmptyRule.ONE
    generic_supports: bool = True
    merge_supports: bool = True
    supports: tuple[str, ...] | None = None
    instance_categories: tuple[str, ...] | None = None
    use_node: bool = True
    use_edge: bool = True
    use_structure: bool = True

    def __post_init__(self) -> None:
        if not (self.use_node or self.use_edge or self.use_structure):
            raise InputError("at least one of use_node, use_edge, use_structure must be on")
        for floor in (self.floor, self.image_floor, self.subtask_floor):
            if not 0 < floor <= 1:
                raise InputError(f"floor {floor} is not above 0 and at most 1")
        if not 0 <= self.state_weight < 1:
            raise InputError(f"state_weight {self.state_weight} is not at least 0 and below 1")

    def of(self, domain: Domain) -> CountedConfig:
        """The options with what the domain says in the place of None.

        Raises:
            UnknownNameError: a relation that the domain does not have.
        """
        for predicate in self.predicates or ():
            if predicate not in domain.relations:
                raise UnknownNameError("relation", predicate, domain.relations)
        unseen = tuple(sorted(a.name for a in domain.attributes.values() if not a.camera))
        given = {f.name: getattr(self, f.name) for f in fields(ScoreConfig)}
        own = {
            "ignored_attributes": unseen,
            "predicates": domain.scored,
            "supports": domain.tagged(domain.roles.support),
            "instance_categories": domain.tagged(domain.roles.numbered),
        }
        return CountedConfig(**{**given, **{k: v for k, v in own.items() if given[k] is None}})


@dataclass(frozen=True, slots=True)
class CountedConfig(ScoreConfig):
    """Options in which nothing is left to the domain any more."""

    ignored_attributes: tuple[str, ...] = ()
    predicates: tuple[str, ...] = ()
    supports: tuple[str, ...] = ()
    instance_categories: tuple[str, ...] = ()
