//! What is made of a solved frame.

use super::http::{FITS, HTML, JSON};
use super::work::{Input, Wanted};
use crate::cli::solving::SolvedImage;
use anyhow::anyhow;
use serde_json::json;
use starpipe::catalog::Catalog;
use starpipe::frame::{Buffers, Colors, RowOrder};
use starpipe::report::overlay::{self, OverlayFormat, OverlayOptions, Rings, Shown, SkyLayers};
use starpipe::report::{FrameReport, page, wcs};

impl Wanted {
    /// What the parameters of `/solve` ask for, which have the words of `process`.
    pub(super) fn stated(
        answer: Option<&str>,
        rings: Option<&str>,
        draw: Option<&str>,
    ) -> Result<Self, String> {
        let wanted = match answer.unwrap_or("json") {
            "json" => Self::Report,
            "view" => Self::View,
            "html" => Self::Html,
            "csv" => Self::Csv,
            "wcs" => Self::Wcs,
            "png" => return Ok(Self::Picture(stated_rings(rings)?, stated_layers(draw)?)),
            _ => return Err("answer must be json, csv, wcs, png, html or view".to_owned()),
        };
        if rings.or(draw).is_some() {
            return Err("rings and draw belong to answer=png".to_owned());
        }
        Ok(wanted)
    }

    /// Its kind of content.
    pub(super) fn kind(self) -> &'static str {
        match self {
            Self::Report | Self::View => JSON,
            Self::Html => HTML,
            Self::Csv => "text/csv; charset=utf-8",
            Self::Wcs | Self::SolvedCopy => FITS,
            Self::Annotated => "image/jpeg",
            Self::Picture(..) | Self::Detections => "image/png",
        }
    }
}

fn stated_rings(stated: Option<&str>) -> Result<Rings, String> {
    match stated.unwrap_or("named") {
        "named" => Ok(Rings::Named),
        "all" => Ok(Rings::All),
        "none" => Ok(Rings::None),
        _ => Err("rings must be named, all or none".to_owned()),
    }
}

fn stated_layers(stated: Option<&str>) -> Result<SkyLayers, String> {
    let Some(stated) = stated else {
        return Ok(SkyLayers::default());
    };
    let mut layers = SkyLayers::NONE;
    for layer in stated.split(',') {
        match layer {
            "none" => {}
            "constellations" => layers.constellations = true,
            "deep-sky" => layers.deep_sky = true,
            "grid" => layers.equatorial_grid = true,
            "altaz-grid" => layers.horizontal_grid = true,
            _ => {
                let message = "draw must be none, or of constellations, deep-sky, grid, altaz-grid";
                return Err(message.to_owned());
            }
        }
    }
    Ok(layers)
}

/// What is wanted of a solved frame.
pub(super) fn made(
    wanted: Wanted,
    input: &Input,
    solved: &SolvedImage,
    catalog: &Catalog,
    buffers: &mut Buffers,
) -> anyhow::Result<Vec<u8>> {
    let SolvedImage { solution, frame } = solved;
    let report = || FrameReport::new(&input.name, solution, catalog);
    let not_identified = || anyhow!("the picture is not identified");
    match wanted {
        Wanted::Report => return Ok((report().to_json_line()? + "\n").into_bytes()),
        Wanted::Csv => return Ok(report().to_csv(true)?.into_bytes()),
        Wanted::Wcs => return wcs::header(&input.name, solution).ok_or_else(not_identified),
        _ => {}
    }
    let frame = frame.as_ref();
    let frame = frame.ok_or_else(|| anyhow!("a list of stars has no picture"))?;
    if wanted == Wanted::SolvedCopy {
        let copy = wcs::solved_copy(&input.name, frame, solution, RowOrder::TopDown)?;
        return copy.ok_or_else(not_identified);
    }
    let colors = Colors::decode(&input.content, frame, buffers);
    let mut shown = Shown::new(&input.name, frame);
    shown.colors = colors.as_ref();
    let options = overlay_options(wanted);
    match wanted {
        Wanted::Html => {
            let page = page::html(&report(), solution, catalog, Some(&shown), &options)?;
            Ok(page.into_bytes())
        }
        Wanted::View => {
            let report = report();
            let view = page::view(&report, solution, catalog, &shown, &options)?;
            // The report as it was written: the page saves it.
            let json = report.to_json_line()?;
            let answer = json!({"json": json, "html": view.html, "data": view.data});
            Ok(answer.to_string().into_bytes())
        }
        _ => Ok(overlay::encoded(&shown, solution, catalog, &options)?),
    }
}

fn overlay_options(wanted: Wanted) -> OverlayOptions {
    let mut options = OverlayOptions::default();
    match wanted {
        Wanted::Annotated => options.format = OverlayFormat::Jpeg,
        Wanted::Detections => {
            options.rings = Rings::All;
            options.sky = SkyLayers::NONE;
        }
        Wanted::Picture(rings, sky) => {
            options.rings = rings;
            options.sky = sky;
        }
        _ => {}
    }
    options
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_stated_in_the_words_of_process() {
        let stated = Wanted::stated;
        assert_eq!(stated(None, None, None), Ok(Wanted::Report));
        let usual = Wanted::Picture(Rings::Named, SkyLayers::default());
        assert_eq!(stated(Some("png"), None, None), Ok(usual));
        let mut grid = SkyLayers::NONE;
        grid.equatorial_grid = true;
        let drawn = stated(Some("png"), Some("all"), Some("grid,none"));
        assert_eq!(drawn, Ok(Wanted::Picture(Rings::All, grid)));
        for (answer, rings, draw) in [
            (Some("PNG"), None, None),
            (Some("png"), Some("some"), None),
            (Some("png"), None, Some("grid,")),
            (Some("csv"), Some("all"), None),
            (None, None, Some("grid")),
        ] {
            assert!(stated(answer, rings, draw).is_err(), "{answer:?}");
        }
    }
}
