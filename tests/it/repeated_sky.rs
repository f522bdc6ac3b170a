//! A sky that stands in its picture more than once is told.

use crate::common::{fixture, orion, shared_dir, sky};
use starpipe::frame;
use starpipe::{Context, Frame, Note, Workspace, solve_frame};
use std::path::Path;

/// A picture whose every pixel is one of the frame's: `from` gives its place, or none for black.
fn picture(
    frame: &Frame,
    [width, height]: [usize; 2],
    from: impl Fn(usize, usize) -> [usize; 2],
) -> Frame<'static> {
    let pixels: Vec<f32> = frame.pixels.values().collect();
    let value = |at: usize| {
        let [x, y] = from(at % width, at / width);
        pixels[y * frame.width + x]
    };
    Frame::new(width, height, (0..width * height).map(value).collect()).unwrap()
}

/// Codes of the notes of an identified picture.
fn codes(frame: &Frame) -> Vec<&'static str> {
    let solution = solve_frame(frame, &Context::new(sky()), &mut Workspace::new()).unwrap();
    assert!(solution.outcome.identification().is_some());
    solution.notes.iter().map(Note::code).collect()
}

#[test]
fn collages_and_mirrored_pictures_are_told() {
    let frame = frame::read(orion()).unwrap();
    let [width, height] = [frame.width, frame.height];
    let four = picture(&frame, [2 * width, 2 * height], |x, y| {
        [x % width, y % height]
    });
    assert!(codes(&four).contains(&"repeated_sky"));
    let mirrored = picture(&frame, [2 * width, height], |x, y| {
        [if x < width { x } else { 2 * width - 1 - x }, y]
    });
    assert!(codes(&mirrored).contains(&"repeated_sky"));
    let turned = picture(&frame, [width, 2 * height], |x, y| {
        [x, if y < height { y } else { 2 * height - 1 - y }]
    });
    assert!(codes(&turned).contains(&"repeated_sky"));
}

#[test]
fn ordinary_frames_show_their_sky_once() {
    let mut frames = vec![orion(), fixture("cygnus/cygnus.tif")];
    if let Some(shared) = shared_dir() {
        let names = ["orion_belt.jpg", "pleiades.jpg", "hale_bopp.jpg"];
        frames.extend(names.map(|name| shared.join("frames").join(name)));
    }
    for path in frames {
        let frame = frame::read(&path).unwrap();
        let is_told = |path: &Path| codes(&frame).contains(&"repeated_sky") && path.exists();
        assert!(!is_told(&path), "{}", path.display());
    }
}
