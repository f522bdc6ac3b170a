//! The same frames as files, for other programs: see `scripts/compare-centroids.py`.

use super::stars::{Field, Star};
use super::{centroids, detection};
use starpipe::frame::Frame;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::Gray16;

/// Frames of each kind and spot size.
const FRAMES: u64 = 3;

#[test]
#[ignore = "writes ninety files to the directory in STARPIPE_PEER_FRAMES"]
fn frames_for_peers() {
    let directory =
        std::env::var_os("STARPIPE_PEER_FRAMES").expect("STARPIPE_PEER_FRAMES is a directory");
    let directory = Path::new(&directory);
    fs::create_dir_all(directory).unwrap();
    for spot_px in [0.5, 0.7, 1.0, 1.25, 1.5] {
        let field = detection::field(spot_px);
        for seed in 0..FRAMES {
            let write = |kind: &str, (stars, frame): (Vec<Star>, Frame)| {
                let name = format!("{kind}-{spot_px:.2}-{seed:03}");
                write_frame(&directory.join(format!("{name}.tiff")), &frame);
                fs::write(directory.join(format!("{name}.csv")), truth(&field, &stars)).unwrap();
            };
            write("centroids", field.frame(&centroids::CLASSES, seed));
            write("detection", detection::frame(&field, seed));
            write("noise", (Vec::new(), field.draw(&[], seed)));
        }
    }
}

fn write_frame(path: &Path, frame: &Frame) {
    let pixels: Vec<u16> = frame.values().iter().map(|&level| level as u16).collect();
    let mut encoder = TiffEncoder::new(fs::File::create(path).unwrap()).unwrap();
    let (width, height) = (frame.width as u32, frame.height as u32);
    encoder
        .write_image::<Gray16>(width, height, &pixels)
        .unwrap();
}

fn truth(field: &Field, stars: &[Star]) -> String {
    let mut text = "x,y,electrons,class,snr,bound_x_px,bound_y_px\n".to_owned();
    for star in stars {
        let bound = centroids::bound(field, star);
        let snr = star.flux_e / field.flux_e(1.0);
        writeln!(
            text,
            "{},{},{},{},{snr},{},{}",
            star.place.x, star.place.y, star.flux_e, star.class, bound.sigma_x_px, bound.sigma_y_px
        )
        .unwrap();
    }
    text
}
