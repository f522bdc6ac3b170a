"""Results as pictures and tables."""

from xml.etree import ElementTree

import numpy as np


def test_a_plot_has_a_ring_for_each_detection_and_the_top_row_on_top(result, pixels):
    import matplotlib

    matplotlib.use("agg")
    axes = result.plot(pixels, names=5)
    rings = sum(len(group.get_offsets()) for group in axes.collections)
    assert rings == len(result.stars)
    assert len(axes.texts) <= 5
    low, high = axes.get_ylim()
    assert low > high and axes.get_xlim()[1] == pixels.shape[1] - 0.5
    axes.figure.canvas.draw()


def test_arrow_has_the_same_columns(result):
    table = result.to_arrow()
    columns = result.star_columns
    assert table.column_names == list(columns)
    np.testing.assert_array_equal(table["flux"].to_numpy(), columns["flux"])
    assert table["id"].to_pylist() == list(columns["id"])


def test_a_card_for_notebooks(result):
    card = result._repr_html_()
    picture, table = ElementTree.fromstring(card)
    circles = [mark for mark in picture if mark.tag.endswith("circle")]
    assert len(circles) == len(result.stars) and "Deneb" in card
    match = result.to_dict()["match"]
    assert f"{match['matched']} of {match['detected']} named" in [row[1].text for row in table]
    assert "\n" not in repr(result)


def test_a_card_of_centroids(pipeline, result):
    stars = result.star_columns
    found = pipeline.identify(stars["x"], stars["y"], flux=stars["flux"], shape=(384, 512))
    assert found._repr_html_().count("<circle") == len(stars["x"])
