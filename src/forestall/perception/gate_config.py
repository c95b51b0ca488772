"""Every number of the input gate, frozen and with its source. Read by the files `gate*.py`.

The limits say what cannot be, not what is rare. Distances to the nearest case that passes and the
nearest that does not were measured on 205 kitchen pictures of ten tasks and on five scenes of real
depth cameras, each also with broken geometry (see docs/observation-format.md).
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class GateConfig:
    """What one observation may say; metres, degrees, shares in [0, 1].

    Args:
        rows: rows of the coarse lattice on which a picture is looked at.
        min_view_deg: narrowest field of view along a side; depth cameras have 40 to 90.
        max_view_deg: widest; a pinhole camera cannot have 180.
        max_aspect: largest ratio of fx and fy; pixels of cameras are nearly square.
        reach_m: farthest from the origin that a camera may be: clouds are kept on a grid of ± 65 m.
        min_height_m: lowest that a camera may be above the floor on which the robot stands.
        max_height_m: highest.
        min_distance_m: median distance below which depth is in another unit; depth cameras begin
            at 0.1 to 0.3 m.
        max_distance_m: above which it is; they end at 10 m.
        min_spread_m: smallest difference of distances in a picture; less is a constant.
        max_roughness: median step between neighbouring pixels, as a share of the distance, above
            which depth is noise; real cameras: under 0.01.
        black: brightest value of a picture without light.
        least_score: detections that are surer count as seen.
        whole_share: share of a picture that a movable thing may cover.
        min_normals: surface patches without which directions say nothing.
        level: cosine to the vertical from which a patch lies flat (14 degrees), and up to which it
            stands upright (its sine).
        min_upright: share of patches that lie or stand by the stated gravity. Rooms have 0.8, a
            cluttered bin 0.37; with wrong axes 0.02 to 0.3.
        clear_upright: share that must lie or stand by another direction to call the stated one
            wrong: a room that leans as a whole.
        clear_flat: share of flat patches that this other direction must have.
        lean_said_deg: angle between the stated gravity and that of the planes in a picture from
            which it is said (a camera on a robot: 1 or 2).
        lean_refused_deg: from which it is refused, where planes lie and others stand by it.
        lean_near_deg: how far from a direction a patch counts as of it.
        lean_share: share of patches that must lie or stand by the planes' gravity.
        lean_ratio: how many times as many must lie by it as by the stated one.
        least_flat: share of a support's patches that lie flat, below which something is wrong if
            the others agree on another direction.
        min_edges: outline cells of masks without which they are not held against depth.
        edge_step: bend of inverse depth, as a share of it, that counts as an edge (planes: 0).
        sure_hit: share of outlines on an edge of depth that settles the question (kitchens: 0.5
            to 0.9, masks shifted by 60 pixels: 0.1 to 0.3).
        min_hit: share that another place of the masks must reach to be called the right one.
        hit_ratio: how many times better that other place must fit (right masks: up to 1.07).
        near_cells: shift in cells that counts as the same place.
        far_cells: widest shift that is tried; 24 cells are 96 pixels of 480 rows.
        floor_off_m: how far a floor may be seen from where the robot stands (real: 0.09).
        hand_off_m: how far from the hand a held thing may be seen (measured: up to 0.07).
        sized_cells: cells of a mask from which its size is judged.
        too_large: visible extent over the category's from which one thing is no such thing.
        all_too_large: the same for all things of a picture, two or more.
        too_small: the same downwards for a picture with one whole thing (real: 0.58).
        all_too_small: the largest of two or more whole things (kitchens: 0.8; real: 0.58, one
            alone).
        lone_refused: how many times too large or small one thing alone is where no wrong name
            explains it (a detector's mistakes in the tests of sensors: up to 3.8).
        covered: share of an outline behind something nearer from which a thing is not whole.
        covered_step: how much nearer, as a share of the distance.
        furniture_small: largest of two or more whole things, where the height of furniture says
            the same of depth.
        furniture_large: smallest of them.
        furniture_off: factor of depth that the height of furniture must show at least.
        furniture_near: factor by which what it shows and what things show may differ.
    """

    rows: int = 120
    min_view_deg: float = 10.0
    max_view_deg: float = 150.0
    max_aspect: float = 2.0
    reach_m: float = 60.0
    min_height_m: float = 0.05
    max_height_m: float = 10.0
    min_distance_m: float = 0.08
    max_distance_m: float = 20.0
    min_spread_m: float = 0.001
    max_roughness: float = 0.08
    black: int = 8
    least_score: float = 0.05
    whole_share: float = 0.9
    min_normals: int = 300
    level: float = 0.97
    min_upright: float = 0.35
    clear_upright: float = 0.6
    clear_flat: float = 0.1
    lean_said_deg: float = 4.0
    lean_refused_deg: float = 10.0
    lean_near_deg: float = 3.0
    lean_share: float = 0.35
    lean_ratio: float = 2.0
    least_flat: float = 0.1
    min_edges: int = 150
    edge_step: float = 0.02
    sure_hit: float = 0.45
    min_hit: float = 0.08
    hit_ratio: float = 1.8
    near_cells: int = 2
    far_cells: int = 24
    floor_off_m: float = 0.25
    hand_off_m: float = 0.35
    sized_cells: int = 40
    too_large: float = 3.0
    all_too_large: float = 1.6
    too_small: float = 0.3
    all_too_small: float = 0.5
    lone_refused: float = 8.0
    covered: float = 0.1
    covered_step: float = 0.03
    furniture_small: float = 0.75
    furniture_large: float = 1.15
    furniture_off: float = 1.3
    furniture_near: float = 1.25


@dataclass(frozen=True, slots=True)
class WatchConfig:
    """What may change from one observation to the next.

    Args:
        moved_m: shift of a camera that must change a picture.
        turned: change of an entry of its rotation that must (0.002 is a tenth of a degree).
        most_equal: pictures equal to the last bit, one after another while time passed, that are
            believed: a renderer repeats itself, a real camera never does.
        max_speed_m_s: of a camera.
        jump_m: how far a thing that nothing moved may be seen from where it was.
        arm_m: what is nearer to the hand may have been moved by it, or with what it holds.
        jump_share: share of what is seen twice that must have jumped to doubt the pose.
        min_jumps: at least so many things.
        small_m: largest extent of things whose place is compared; of larger ones each view shows
            another part.
        least_cells: cells of the coarse lattice that must show a thing for that.
    """

    moved_m: float = 0.002
    turned: float = 0.002
    most_equal: int = 2
    max_speed_m_s: float = 10.0
    jump_m: float = 0.3
    arm_m: float = 0.4
    jump_share: float = 0.6
    min_jumps: int = 3
    small_m: float = 0.6
    least_cells: int = 20
