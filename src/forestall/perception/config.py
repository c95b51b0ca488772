"""Every number of the perception, frozen and with its source. Read by all files of this package.

REFLECT's spatial heuristics (Liu et al. 2023, its public `scene_graph.py`) are the starting point,
as in the paper (Sec. 3 "3D Scene Graph Construction"): contact 0.1 m, close 0.4 m, inside 0.5, on
top 0.7, direction cosines 0.9 / 0.8 / 0.9, occlusion 0.5. Where REFLECT compares whole clouds
with boxes, the rules here ask for nearer evidence, and so the numbers are tighter.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PerceptionConfig:
    """Thresholds of perception; metres, pixels, shares in [0, 1].

    Args:
        min_pixels: masks under this are ignored (REFLECT drops tiny detections likewise).
        max_points: pixels of one mask that are unprojected; larger masks are thinned on a lattice.
        max_stride: widest stride of that lattice (a power of two); at 640 × 480 and 2 m a stride
            of 4 is 2 cm, so that enough of a floor is left around a mug that lies on it.
        voxel_m: edge of the thinning grid for movable things.
        fixture_voxel_m: the same for furniture, which is large.
        min_cell_support: pixels in a 4-voxel cell and its six neighbours below which the cell is
            an outlier (flying pixels at depth edges).
        sparse_share: share of the pixels that a surface facing the camera would show there under
            which such a cell of a movable thing is one, too.
        dense_share: share of a thing's pixels that must be left by that, else it is a sliver and
            keeps them.
        rim_px: how far a mask may bleed over its thing's outline (masks drawn by hand: 2 to 4).
        core_share: share of a mask that must be left as its core, else the rim is thinner.
        steep: depth per width of a pixel above which neighbours lie on two surfaces (80 degrees).
        edge_m: the same for pixels that are next to each other in space: least step of an edge.
        behind_m: how far behind the core a piece of the rim may lie that is joined to what is
            around and not to the core.
        level_m: how far from a level surface a pixel counts as of it, noise apart.
        flat_m: how much higher a thing's middle must be for that: flat things keep their rims.
        level_share: share of what is around a foot that must lie in one level.
        ring_pixels: so many pixels at least.
        lattice_px: every so many pixels are looked at for unmasked surfaces.
        surface_cells: level cells of that lattice that make a surface.
        surface_m: how far from its height they may lie (a pose that leans by a degree: 0.02).
        foot_cells: cells of it that must show around the foot of what stands on it.
        foot_share: share of what shows around a foot that they must be: in a heap nothing tells on
            what a thing lies.
        floor_slack_m: how far from the floor's height the floor may be seen.
        stray_gap_m: gap along the line of sight over which points of a mask are of two things.
        stray_share: share of a movable thing's pixels under which such a part is not its own
            (real masks, a pixel too wide: up to 0.08).
        box_percentile: share of points cut off at each end of a box.
        contact_above_m: how far a support's surface may lie above the lowest point that rests on
            it (dents, rims).
        contact_below_m: how far it may lie below (the lowest part is often hidden). Under
            REFLECT's 0.1 m because supports are tested beneath the object only.
        ring_m: how far around an object's footprint its support's surface is looked for, since
            the object hides what is right below it.
        min_contacts: support points that must be found there.
        inside_share: share of points within the container's footprint (REFLECT: 0.5).
        on_top_share: share of points above the support's footprint (REFLECT: 0.7).
        on_dish_share: the same for a dish of which plenty of contacts show; what lies on it hides
            its far half.
        plenty_contacts: so many support points.
        on_strange_share: the same for a thing of no known category, where nothing known carries it.
        covered_share: share of a small support that lies under an object (a burner under a pot).
        footprint_slack_m: tolerance of footprints.
        sectors: directions in which walls are looked for around something contained.
        enclosed_sectors: how many of them must have a wall.
        wall_reach_m: height band around an object in which a wall counts.
        rim_slack_m: how far above an open rim the lowest visible point may lie.
        close_m: gap under which direction relations are stated (REFLECT: CLOSE_DISTANCE).
        near_m: gap under which two things are near (REFLECT: IN_CONTACT_DISTANCE).
        vertical_cosine: direction cosine for above and below (REFLECT: 0.9).
        lateral_cosine: for left and right (REFLECT: 0.8).
        frontal_cosine: for in front of and behind (REFLECT: 0.9).
        hand_wide_m: how wide a hand is (as two-finger grippers are), which comes level for the
            middle of a thing: what stands in a way so wide blocks.
        hand_long_m: how far behind its fingertips a hand with its wrist is as low as they are.
        hand_thick_m: how thick it is; it grasps at half a thing's height, and what stays under it
            blocks nothing.
        hand_over_m: how far over what it works on it stays at least.
        oblong: how much longer the long side of a support must be to tell its front.
        floor_m: things whose foot is lower are reached from above.
        headroom_m: things in containers that do not rise higher above them likewise.
        occlusion_share: share of a mask's outline that the nearer mask cuts off (REFLECT asks for
            an image overlap of 0.5 of whole boxes; an outline is evidence of real occlusion).
        cut_slack_m: how far beside a thing that it cuts off another one may stand and block it.
        depth_edge_m: step of depth at such an outline.
        free_margin_m: how much farther than a remembered point the depth must be to be called
            free space.
        free_margin_share: the same as a share of the distance (depth noise grows with it).
        gone_share: share of remembered points seen to be free or something else's, above which
            the object has gone.
        unmoved_share: share of remembered points that a new view must confirm, of those that it
            confirms or refutes, for a thing to be where it was.
        expected_pixels: expected size in the image, as a multiple of `min_pixels`, above which a
            missing detection means something.
        interior_share: share of a container's depth samples that must be seen for its inside to
            count as observed.
        glimpse_share: views of a thing with a smaller share of its largest view's pixels, in one
            observation, say nothing about its states.
        sliver_share: what shows less than this share of the area that it has shown before
            contradicts nothing that is believed of its states, unless it is furniture.
        steady: probability that a state is still what it was surely read to be, or what a skill
            should have made of it; the rest is for what changed unseen and for skills that failed.
        outweighs: probability from which a reading is believed against that.
        same_share: share of the smaller of two boxes that both must have for a new thing to be one
            of the same category that was there before and is not seen.
        max_lost: things of one category whose place is lost that are remembered; the last ones.
        max_things: things remembered in all; what has not been observed for longest goes first.
        same_place_m: distance over which an untracked detection is the same object as before.
        same_gap_m: gap of boxes over which a thing that nothing moved is another one (the error of
            a pose: 1 cm).
        same_gap_share: the same as a share of how far away it is (2 degrees).
        unlike_m: metres that it counts to differ wholly in colour, or in size by a factor of 2.7,
            where several things are near enough.
        unlike_far_m: the same for things that come back at another place.
        cell_m: edge of a cell of a surface that some view has shown or none has.
        over_m: how far over it a view must reach to have shown it.
        piece_cells: edge of the least piece, in cells, that counts as never shown.
        same_surface_share: share of what an untracked view shows of a piece of furniture that must
            lie on what is known of it, or the other way round, to be the same piece.
    """

    min_pixels: int = 20
    max_points: int = 4000
    max_stride: int = 4
    voxel_m: float = 0.008
    fixture_voxel_m: float = 0.02
    min_cell_support: int = 4
    sparse_share: float = 0.1
    dense_share: float = 0.5
    rim_px: int = 9
    core_share: float = 0.25
    steep: float = 6.0
    edge_m: float = 0.004
    behind_m: float = 0.01
    level_m: float = 0.003
    flat_m: float = 0.008
    level_share: float = 0.5
    ring_pixels: int = 12
    lattice_px: int = 4
    surface_cells: int = 60
    surface_m: float = 0.025
    foot_cells: int = 6
    foot_share: float = 0.35
    floor_slack_m: float = 0.1
    stray_gap_m: float = 0.08
    stray_share: float = 0.1
    box_percentile: float = 0.01
    contact_above_m: float = 0.015
    contact_below_m: float = 0.035
    ring_m: float = 0.04
    min_contacts: int = 3
    inside_share: float = 0.5
    on_top_share: float = 0.7
    on_dish_share: float = 0.4
    plenty_contacts: int = 30
    on_strange_share: float = 0.6
    covered_share: float = 0.5
    footprint_slack_m: float = 0.01
    sectors: int = 8
    enclosed_sectors: int = 5
    wall_reach_m: float = 0.06
    rim_slack_m: float = 0.02
    close_m: float = 0.4
    near_m: float = 0.1
    vertical_cosine: float = 0.9
    lateral_cosine: float = 0.8
    frontal_cosine: float = 0.9
    cell_m: float = 0.05
    over_m: float = 0.03
    piece_cells: int = 2
    hand_wide_m: float = 0.09
    hand_long_m: float = 0.30
    hand_thick_m: float = 0.05
    hand_over_m: float = 0.03
    oblong: float = 1.15
    floor_m: float = 0.3
    headroom_m: float = 0.1
    occlusion_share: float = 0.12
    cut_slack_m: float = 0.02
    depth_edge_m: float = 0.03
    free_margin_m: float = 0.02
    free_margin_share: float = 0.01
    gone_share: float = 0.5
    unmoved_share: float = 0.8
    expected_pixels: float = 4.0
    interior_share: float = 0.1
    glimpse_share: float = 0.5
    sliver_share: float = 0.25
    steady: float = 0.9
    outweighs: float = 0.8
    same_place_m: float = 0.3
    same_gap_m: float = 0.05
    same_gap_share: float = 0.035
    unlike_m: float = 0.1
    unlike_far_m: float = 2.0
    same_surface_share: float = 0.25
    same_share: float = 0.3
    max_lost: int = 5
    max_things: int = 400


@dataclass(frozen=True, slots=True)
class ScopeConfig:
    """What a graph for one subtask keeps.

    Args:
        whole: keep every node and relation (the subtask node is still set).
        fellows: keep what stands beside an argument in the same small receptacle.
    """

    whole: bool = False
    fellows: bool = True
