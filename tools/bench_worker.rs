//! starpipe's side of `scripts/bench-peers`: reads orders as lines of JSON, answers each with a
//! line.
//!
//! usage: `bench_worker FROM:TO`, the range of horizontal fields in degrees.

use serde_json::{Value, json};
use starpipe::catalog::Catalog;
use starpipe::detect::{self, DetectConfig, Detections, detect_into};
use starpipe::ephemeris::places::StarPlaces;
use starpipe::frame::{self, Frame};
use starpipe::identify::{self, Identification, IndexedCatalog, Priors, ScalePrior};
use starpipe::solve::{Context, Workspace, find_pointing_in, star_field};
use std::error::Error;
use std::io::{BufRead, Write};
use std::path::Path;
use std::time::Instant;

/// The solvers are given at most this many stars, the brightest, where pointing alone is timed.
const MAX: usize = 60;
const ARCSEC_PER_RAD: f64 = 206_264.806;

/// The stages that are timed, and their buffers.
struct Bench<'a> {
    indexed: IndexedCatalog<'a>,
    fields_deg: (f64, f64),
    frame: Frame<'static>,
    detect: detect::Workspace,
    identify: identify::Workspace,
    solve: Workspace,
    /// Detections of the loaded frame.
    known: Detections,
    found: Detections,
}

impl Bench<'_> {
    fn load(&mut self, path: &str) -> Result<Value, Box<dyn Error>> {
        self.frame = frame::read(Path::new(path))?;
        self.extract()?;
        self.known = self.found.clone();
        Ok(json!({}))
    }

    fn extract(&mut self) -> Result<f64, Box<dyn Error>> {
        let start = Instant::now();
        let config = DetectConfig::default();
        detect_into(&self.frame, &config, &mut self.detect, &mut self.found)?;
        Ok(milliseconds(start))
    }

    fn priors(&self, is_known: bool) -> Priors {
        let half_width = 0.5 * self.frame.width as f64;
        let scale_rad = |fov_deg: f64| (0.5 * fov_deg.to_radians()).tan() / half_width;
        let (from, to) = self.fields_deg;
        Priors {
            scale: is_known.then(|| ScalePrior::between(scale_rad(from), scale_rad(to))),
            ..Priors::default()
        }
    }

    /// Identifies the stars of the loaded frame, or the detections just made.
    fn solve(&mut self, is_known: bool, is_fresh: bool) -> (f64, Option<&Identification>) {
        let priors = self.priors(is_known);
        let start = Instant::now();
        let detections = if is_fresh { &self.found } else { &self.known };
        let field = star_field(&self.frame, detections, StarPlaces::default());
        let answer = self.identify.identify(&field, &priors, &self.indexed);
        (milliseconds(start), answer.ok())
    }

    /// Attitude from the brightest stars, of as many as the other programs are given.
    fn brightest(&mut self, is_known: bool) -> (f64, Option<Identification>) {
        let priors = self.priors(is_known);
        let mut field = star_field(&self.frame, &self.known, StarPlaces::default());
        field.stars.truncate(MAX);
        let start = Instant::now();
        let found = self.identify.attitude(&field, &priors, &self.indexed);
        (milliseconds(start), found.ok().cloned())
    }

    /// The pointing alone, from pixels to the attitude.
    fn point(&mut self, is_known: bool) -> Result<Value, Box<dyn Error>> {
        let priors = self.priors(is_known);
        let mut context = Context::new(&self.indexed);
        context.priors = priors;
        let start = Instant::now();
        let found = find_pointing_in(&self.frame, &context, &mut self.solve)?;
        Ok(to_json(milliseconds(start), found))
    }

    /// Time of naming all stars of the loaded frame, after pointing.
    fn naming(&mut self, is_known: bool) -> (f64, Option<Identification>) {
        let priors = self.priors(is_known);
        let field = star_field(&self.frame, &self.known, StarPlaces::default());
        let pointing = self.identify.find_pointing(&field, &priors, &self.indexed);
        let start = Instant::now();
        let found = pointing.and_then(identify::PointedField::name_stars);
        (milliseconds(start), found.ok().cloned())
    }

    fn answer(&mut self, order: &Value) -> Result<Value, Box<dyn Error>> {
        let is_known = order["known"] == true;
        match order["do"].as_str().unwrap_or_default() {
            "load" => self.load(order["path"].as_str().unwrap_or_default()),
            "extract" => {
                let ms = self.extract()?;
                Ok(json!({"ms": ms, "found": self.found.sources.len()}))
            }
            "solve" => {
                let (ms, found) = self.solve(is_known, false);
                Ok(to_json(ms, found))
            }
            "pointing" => {
                let (pointing_ms, found) = self.brightest(is_known);
                Ok(to_json(pointing_ms, found.as_ref()))
            }
            "naming" => {
                let (naming_ms, found) = self.naming(is_known);
                Ok(to_json(naming_ms, found.as_ref()))
            }
            "stars" => {
                let field = star_field(&self.frame, &self.known, StarPlaces::default());
                let stars = field.brightest(MAX).iter();
                let stars = stars.map(|s| [s.position.x, s.position.y, 10f64.powf(-0.4 * s.mag)]);
                Ok(json!({"stars": stars.collect::<Vec<_>>()}))
            }
            "point" => self.point(is_known),
            "whole" => {
                let extract_ms = self.extract()?;
                let (ms, found) = self.solve(is_known, true);
                Ok(to_json(extract_ms + ms, found))
            }
            other => Err(format!("no such order: {other:?}").into()),
        }
    }
}

fn to_json(ms: f64, found: Option<&Identification>) -> Value {
    let arcsec =
        |found: &Identification| found.rms_px / found.camera.focal_length_px() * ARCSEC_PER_RAD;
    json!({
        "ms": ms,
        "solved": found.is_some(),
        "matches": found.map(|found| found.matches.len()),
        "rms_arcsec": found.map(arcsec),
    })
}

fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

fn main() -> Result<(), Box<dyn Error>> {
    let range = std::env::args().nth(1).unwrap_or_default();
    let (from, to) = range.split_once(':').ok_or("usage: bench_worker FROM:TO")?;
    let mut bench = Bench {
        indexed: IndexedCatalog::build(Catalog::built_in(), &|_| {}),
        fields_deg: (from.parse()?, to.parse()?),
        frame: Frame::new(3, 3, vec![0.0; 9])?,
        detect: detect::Workspace::new(),
        identify: identify::Workspace::new(),
        solve: Workspace::new(),
        known: Detections::default(),
        found: Detections::default(),
    };
    for line in std::io::stdin().lock().lines() {
        let answer = bench.answer(&serde_json::from_str(&line?)?)?;
        println!("{answer}");
        std::io::stdout().flush()?;
    }
    Ok(())
}
