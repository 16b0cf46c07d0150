"""The picture of a certificate: every kind of verdict can be drawn, and colour says where it is tight."""

import functools

import casadi as ca
import numpy as np
import pytest
from matplotlib.colors import to_rgb

import gammastar as gs
from certificate.curves import QUAD, SATELLITE, closed, figure_eight, trefoil
from gammastar.certificate import Certificate, Limits, certify
from gammastar.figures import style
from gammastar.figures.certificate import _Colors, draw_certificate
from gammastar.figures.save import picture

KINDS = {
    "flyable": lambda: certify(QUAD, gs.paths.loop(radius=2.0), 1.0),
    "falling at the top": lambda: certify(QUAD, gs.paths.loop(radius=2.0), 2.2),
    "beyond its thrust": lambda: certify(QUAD, closed(trefoil), 1.5, limits=Limits(thrust=9.8)),
    "crossing itself": lambda: certify(QUAD, closed(figure_eight), 1.0),
    "with a cusp": lambda: certify(QUAD, closed(lambda t: (ca.cos(t) ** 3, ca.sin(t) ** 3, 0 * t)), 1.0),
    "weightless": lambda: certify(SATELLITE, gs.paths.line(), 1.0),
    "standing still": lambda: certify(QUAD, gs.paths.helix(), 0.0),
}


@functools.cache
def certificate(kind: str) -> Certificate:
    return KINDS[kind]()


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_certificate_can_be_drawn(kind: str) -> None:
    figure = draw_certificate(
        certificate(kind), "what costs $5 and is a long title that has to be folded into its figure"
    )
    assert picture(figure, "png", resolution=40).startswith(b"\x89PNG")
    assert picture(figure, "svg") == picture(draw_certificate(certificate(kind), figure._suptitle.get_text()), "svg")


def test_a_picture_does_not_depend_on_the_frame_that_points_are_named_in() -> None:
    """Figures show `ned`: marks lie on the path in both frames."""
    drawn = [draw_certificate(certify(QUAD, gs.paths.loop(radius=2.0), 2.2, frame=frame)) for frame in ("ned", "enu")]
    assert picture(drawn[0], "svg") == picture(drawn[1], "svg")


def test_a_fault_of_geometry_leaves_no_colours() -> None:
    assert len(draw_certificate(certificate("with a cusp")).axes) == 1
    assert len(draw_certificate(certificate("flyable")).axes) == 2


def test_the_places_that_decide_are_named_with_their_values() -> None:
    words = [text.get_text() for text in draw_certificate(certificate("falling at the top")).legends[0].get_texts()]
    assert "start" in words
    assert "closest to itself: 4 m" in words
    assert "sharpest bend: radius 2 m" in words
    assert any(word.startswith("least specific thrust: 0.12") for word in words)
    assert "beyond a limit" in words


def test_colours_part_what_fails_from_what_is_tight() -> None:
    margin = np.array([-0.5, -1e-9, 0.0, 0.4, 0.9])
    shades = _Colors(margin).of(margin)[:, :3]
    assert np.allclose(shades[:2], to_rgb(style.VERMILION), atol=0.01)
    assert np.allclose(shades[2], to_rgb(style.ORANGE), atol=0.01)
    assert np.allclose(shades[4], to_rgb(style.BLUE), atol=0.01)


def test_equal_margins_have_one_colour() -> None:
    margin = 0.9 + 1e-12 * np.arange(5)
    assert np.ptp(_Colors(margin).of(margin), axis=0).max() < 0.01
