use super::*;

/// A small figure with everything that charts have.
fn sheet() -> Sheet {
    let dots = [(1.0, -2.0, [-3.0, -1.0]), (100.0, 2.0, [1.5, 2.5])];
    let panel = Panel {
        title: "a <b> & c".to_owned(),
        x: Axis::log("frequency (Hz)", true).within(1.0, 100.0),
        y: Axis::new("change (mag)"),
        layers: vec![
            PlotLayer::guide(Marks::Levels(vec![0.0])),
            PlotLayer::new(
                "line",
                Rgb::ORANGE,
                Marks::Line(vec![(1.0, -2.0), (100.0, 2.0)]),
            ),
            PlotLayer::new("dots", Rgb::BLUE, Marks::Dots(dots.map(Dot::from).into())),
        ],
        ..Panel::default()
    };
    let mut sheet = Sheet::of_one(panel);
    sheet.frame_px = [120.0, 80.0];
    sheet
}

#[test]
fn a_small_chart() {
    insta::assert_snapshot!(sheet().svg());
}

#[test]
fn a_map_has_the_bar_of_its_colors() {
    let scale = ColorScale {
        title: "difference (mag); white: none".to_owned(),
        ends: [-1.0, 1.0],
        is_log: false,
        palette: diverging,
    };
    let area = Area::rectangle([0.0, 30.0], [0.0, f64::INFINITY], scale.color(-1.0));
    let panel = Panel {
        x: Axis::new("x (px)").within(0.0, 30.0),
        y: Axis::new("y (px)").within(20.0, 0.0),
        layers: vec![PlotLayer::colored(vec![area], scale)],
        kind: PanelKind::Map,
        ..Panel::default()
    };
    let svg = Sheet::of_one(panel).svg();
    assert!(
        svg.contains(">−1.0</text>") && svg.contains("white: none"),
        "{svg}"
    );
    assert!(is_figure(svg.as_bytes()) && !svg.contains("NaN") && !svg.contains("inf"));
}

#[cfg(feature = "overlay")]
#[test]
fn a_bitmap_has_two_pixels_for_each_of_the_drawing() {
    let picture = image::load_from_memory(&sheet().png().unwrap())
        .unwrap()
        .into_rgb8();
    let svg = sheet().svg();
    assert!(svg.contains(&format!("width=\"{}\"", picture.width() / 2)));
    assert!(picture.pixels().any(|pixel| pixel.0 == Rgb::BLUE.0));
}
