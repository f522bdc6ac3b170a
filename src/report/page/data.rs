//! What the scripts of a page draw.

use crate::base::format::to_decimals;
use crate::catalog::Catalog;
use crate::identify::StarMatch;
use crate::report::frame_report::{CompletenessReport, StarReport};
use crate::report::overlay::{SkyLayer, sky_layers};
use crate::report::{AnnotationReport, FrameReport};
use crate::solve::{Solution, Source};
use serde::Serialize;

/// The numbers of a page.
#[derive(Debug, Serialize)]
pub(super) struct PageData<'a> {
    width: usize,
    height: usize,
    /// Detections, brightest first.
    stars: StarColumns<'a>,
    /// Numbers of those that are not shaped like stars.
    unlike_stars: Vec<usize>,
    completeness: &'a [CompletenessReport],
    zero_point_vmag: Option<f64>,
    /// Seconds by which fluxes are divided before the zero point applies.
    zero_point_exposure_s: f64,
    limit50_vmag: Option<f64>,
    predicted_vmag: Option<f64>,
    /// Lines and names of the sky.
    pub(super) sky: Vec<SkyLayer>,
    /// What has a name in the frame.
    annotations: &'a [AnnotationReport],
}

/// The columns of the detections, which take half of the room of rows with names.
#[derive(Debug, Default, Serialize)]
struct StarColumns<'a> {
    x: Vec<f64>,
    y: Vec<f64>,
    /// Observed minus predicted position, in pixels.
    dx: Vec<Option<f64>>,
    dy: Vec<Option<f64>>,
    snr: Vec<Option<f64>>,
    flux: Vec<Option<f64>>,
    id: Vec<Option<&'a str>>,
    name: Vec<Option<&'a str>>,
    /// What it is called in a picture, for those that are named.
    label: Vec<Option<String>>,
    hip: Vec<Option<u32>>,
    hd: Vec<Option<u32>>,
    v: Vec<Option<f64>>,
    ra: Vec<Option<f64>>,
    dec: Vec<Option<f64>>,
    flags: Vec<&'a [&'static str]>,
}

impl<'a> StarColumns<'a> {
    fn add(&mut self, star: &'a StarReport, offset: Option<[f64; 2]>, label: Option<String>) {
        let rounded = |value: f64, decimals| to_decimals(value, decimals);
        self.x.push(rounded(star.x, 2));
        self.y.push(rounded(star.y, 2));
        self.dx.push(offset.map(|[dx, _]| rounded(dx, 3)));
        self.dy.push(offset.map(|[_, dy]| rounded(dy, 3)));
        self.snr.push(star.snr);
        self.flux.push(star.flux);
        self.id.push(star.id.as_deref());
        self.name.push(star.name.as_deref());
        self.label.push(label);
        self.hip.push(star.hip);
        self.hd.push(star.hd);
        self.v.push(star.vmag);
        self.ra.push(star.ra_deg.map(|ra| rounded(ra, 4)));
        self.dec.push(star.dec_deg.map(|dec| rounded(dec, 4)));
        self.flags.push(&star.flags);
    }
}

impl<'a> PageData<'a> {
    /// The numbers of a frame.
    pub(super) fn new(report: &'a FrameReport, solution: &Solution, catalog: &Catalog) -> Self {
        let catalog = solution.catalog(catalog);
        let photometry = report.photometry.as_ref();
        let is_rate = photometry.is_some_and(|photometry| photometry.flux_unit.ends_with("/s"));
        let unlike = |(_, star): &(usize, &StarReport)| !star.is_star_like();
        let numbered = report.stars.iter().enumerate();
        let unlike_stars = numbered.filter(unlike).map(|(number, _)| number).collect();
        let mut stars = StarColumns::default();
        let sources = solution.sources.iter().zip(solution.matches_by_source());
        for (star, (source, found)) in report.stars.iter().zip(sources) {
            let offset = offset(solution, source, found);
            stars.add(star, offset, found.map(|found| catalog.label(found.star)));
        }
        Self {
            width: report.width,
            height: report.height,
            stars,
            unlike_stars,
            completeness: photometry.map_or(&[], |photometry| &photometry.completeness),
            zero_point_vmag: photometry.and_then(|photometry| photometry.zero_point_vmag),
            zero_point_exposure_s: report.exposure_s.filter(|_| is_rate).unwrap_or(1.0),
            limit50_vmag: photometry.and_then(|photometry| photometry.limit50_vmag),
            predicted_vmag: report.prediction.as_ref().and_then(|p| p.limit50_vmag),
            sky: sky_layers(solution, catalog),
            annotations: &report.annotations,
        }
    }
}

/// Observed minus predicted position of an identified star, in pixels.
fn offset(solution: &Solution, source: &Source, found: Option<&StarMatch>) -> Option<[f64; 2]> {
    let identified = solution.outcome.identification()?;
    let predicted = identified.pixel_of(&found?.light)?;
    let observed = source.position;
    Some([observed.x - predicted.x, observed.y - predicted.y])
}
