use crate::detect::{DetectConfig, Detections, Workspace, detect};
use crate::frame::Frame;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const WIDTH: usize = 500;
const HEIGHT: usize = 400;

/// A frame with noise of 5 ADU and the light of some points, each a Gaussian of 0.9 px: x, y, flux.
fn detected(rng: &mut ChaCha8Rng, points: impl Iterator<Item = [f64; 3]>) -> Detections {
    const SIGMA_PX: f64 = 0.9;
    let noise = |rng: &mut ChaCha8Rng| (0..12).map(|_| rng.random::<f64>() - 0.5).sum::<f64>();
    let mut pixels: Vec<f64> = (0..WIDTH * HEIGHT)
        .map(|_| 100.0 + 5.0 * noise(rng))
        .collect();
    for [x, y, flux] in points {
        let near = |at: f64, side: usize| {
            (at - 5.0).max(0.0) as usize..((at + 6.0).max(0.0) as usize).min(side)
        };
        for row in near(y, HEIGHT) {
            for column in near(x, WIDTH) {
                let r2 = (column as f64 - x).powi(2) + (row as f64 - y).powi(2);
                let density = (-r2 / (2.0 * SIGMA_PX * SIGMA_PX)).exp()
                    / (2.0 * std::f64::consts::PI * SIGMA_PX * SIGMA_PX);
                pixels[row * WIDTH + column] += flux * density;
            }
        }
    }
    let pixels = pixels.into_iter().map(|p| p as f32).collect();
    let frame = Frame::new(WIDTH, HEIGHT, pixels).unwrap();
    detect(&frame, &DetectConfig::default(), &mut Workspace::new()).unwrap()
}

/// Places at least 12 px from the border, and fluxes, of which few are bright.
fn stars(rng: &mut ChaCha8Rng, count: usize) -> Vec<[f64; 3]> {
    let star = |rng: &mut ChaCha8Rng| {
        let x = rng.random_range(12.0..WIDTH as f64 - 12.0);
        let y = rng.random_range(12.0..HEIGHT as f64 - 12.0);
        [x, y, 1500.0 / rng.random_range(0.02f64..1.0)]
    };
    (0..count).map(|_| star(rng)).collect()
}

/// The light along a line around each star, `light` of the place in −½ to ½.
fn drawn_out(
    stars: &[[f64; 3]],
    [dx, dy]: [f64; 2],
    light: impl Fn(f64) -> f64 + Copy,
) -> impl Iterator<Item = [f64; 3]> {
    const PARTS: usize = 400;
    let part = move |star: [f64; 3], i: usize| {
        let at = (i as f64 + 0.5) / PARTS as f64 - 0.5;
        [
            star[0] + at * dx,
            star[1] + at * dy,
            star[2] * light(at) / PARTS as f64,
        ]
    };
    let stars = stars.to_vec();
    stars
        .into_iter()
        .flat_map(move |star| (0..PARTS).map(move |i| part(star, i)))
}

/// Errors along and across the direction of the detections nearest to the stars that are bright, in
/// pixels; and their largest in units of the stated errors, for 8 of 10 stars: some trails lie on others.
fn errors(found: &Detections, stars: &[[f64; 3]], [dx, dy]: [f64; 2]) -> ([f64; 2], f64) {
    let length = dx.hypot(dy);
    let mut offsets = Vec::new();
    let mut in_sigmas = Vec::new();
    for star in stars.iter().filter(|star| star[2] > 6000.0) {
        let distance = |source: &&crate::detect::Detection| {
            (source.position.x - star[0]).hypot(source.position.y - star[1])
        };
        let nearest = found
            .sources
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap();
        let (x, y) = (nearest.position.x - star[0], nearest.position.y - star[1]);
        offsets.push([(x * dx + y * dy) / length, (y * dx - x * dy) / length]);
        in_sigmas.push(
            (x / nearest.sigma_x_px)
                .abs()
                .max((y / nearest.sigma_y_px).abs()),
        );
    }
    let median = |axis: usize| {
        let mut values: Vec<f64> = offsets.iter().map(|offset| offset[axis].abs()).collect();
        values.sort_unstable_by(f64::total_cmp);
        values[values.len() / 2]
    };
    in_sigmas.sort_unstable_by(f64::total_cmp);
    ([median(0), median(1)], in_sigmas[8 * in_sigmas.len() / 10])
}

#[test]
fn each_star_is_in_the_middle_of_its_trail() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for motion in [[45.0, 20.0], [-30.0, 34.0], [0.0, 60.0], [80.0, -3.0]] {
        let stars = stars(&mut rng, 40);
        let found = detected(&mut rng, drawn_out(&stars, motion, |_| 1.0));
        let trails = found.trails.expect("all stars are trails");
        let length: f64 = f64::hypot(motion[0], motion[1]);
        assert!(
            (trails.length_px / length - 1.0).abs() < 0.04,
            "{motion:?}: {trails:?}"
        );
        let angle = (-motion[1]).atan2(motion[0]);
        assert!((trails.angle_rad - angle).sin().abs() < 0.02, "{trails:?}");
        let ([along, across], in_sigmas) = errors(&found, &stars, motion);
        assert!(
            along < 0.3 && across < 0.15,
            "{motion:?}: {along} {across} {trails:?}"
        );
        assert!(in_sigmas < 4.0, "{motion:?}: {in_sigmas}");
    }
}

#[test]
fn uneven_light_does_not_move_the_middle() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let motion = [45.0, 20.0];
    let stars = stars(&mut rng, 60);
    let found = detected(&mut rng, drawn_out(&stars, motion, |at| 1.0 + 1.2 * at));
    let ([along, _], _) = errors(&found, &stars, motion);
    // The centre of the light is 5 px from the middle.
    assert!(along < 0.4, "{along}");
}

#[test]
fn trails_of_satellites_make_no_trails_of_the_stars() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let stars = stars(&mut rng, 60);
    // Two broken lines across the frame.
    let dashes = (0..40).flat_map(|i| {
        let at = 12.0 * f64::from(i);
        [
            [at, 60.0 + 0.3 * at, 9000.0],
            [at, 300.0 - 0.4 * at, 9000.0],
        ]
    });
    let dashes: Vec<_> = dashes.collect();
    let points = drawn_out(&dashes, [7.0, 0.0], |_| 1.0).chain(stars.iter().copied());
    let found = detected(&mut rng, points);
    assert_eq!(found.trails, None);
}

#[test]
fn pieces_of_satellites_trails_in_similar_directions_are_no_stars() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let stars = stars(&mut rng, 60);
    let mut points = stars.clone();
    for (row, slope) in [(60.0, 0.3), (170.0, 0.2), (330.0, 0.1)] {
        let pieces: Vec<[f64; 3]> = (0..6)
            .map(|piece| 30.0 + 80.0 * f64::from(piece))
            .map(|x| [x, row + slope * (x - 230.0), 40_000.0])
            .collect();
        points.extend(drawn_out(&pieces, [50.0, 50.0 * slope], |_| 1.0));
    }
    let found = detected(&mut rng, points.into_iter());
    assert_eq!(found.trails, None);
}
