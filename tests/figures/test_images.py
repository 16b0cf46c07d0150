"""The images of README and docs: made by one command, small enough to be committed."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

from gammastar.figures.save import picture

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def make() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make", DOCS / "make.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_picture_can_be_drawn_and_is_small(make: ModuleType) -> None:
    assert len(picture(make.readme_picture(make.flight()), "png")) < 300_000


def test_the_campaign_of_the_basin_is_the_one_that_is_told(make: ModuleType) -> None:
    page = (DOCS / "howto" / "campaigns.md").read_text(encoding="utf-8")
    vary = make.CHANGES["campaign.vary"]
    for told in (make.CHANGES["title"], make.CHANGES["flight.duration"], *vary):
        assert repr(told).replace("'", '"') in page
    assert len(vary) == page.count('{"quantity"')
    assert all(f"{flights:,} flights" in page for flights in make.FLIGHTS.values())


def test_the_committed_images_are_small(make: ModuleType) -> None:
    assert (DOCS / "images" / "upside-down.png").stat().st_size < 300_000
    assert all((DOCS / "images" / f"{name}.png").stat().st_size < 150_000 for name in make.FLIGHTS)
    assert (DOCS / "images" / "upside-down.gif").stat().st_size < 1_500_000
