//! Files with figures, as options name them.

use anyhow::Context;
use clap::ValueEnum;
use clap::builder::{PathBufValueParser, TypedValueParser};
use starpipe::report::figure::Sheet;
use std::path::PathBuf;

/// What a figure is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Svg,
    Png,
}

impl Form {
    /// The content of a file with the figure.
    fn render(self, sheet: &Sheet) -> anyhow::Result<Vec<u8>> {
        Ok(match self {
            Self::Svg => sheet.svg().into_bytes(),
            Self::Png => sheet.png()?,
        })
    }
}

/// A file for one figure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PlotFile {
    pub(crate) path: PathBuf,
    form: Form,
}

impl PlotFile {
    /// The extension of the name says what the figure is made of.
    fn new(path: PathBuf) -> Result<Self, String> {
        let extension = path
            .extension()
            .and_then(|extension| extension.to_str())
            .unwrap_or_default();
        let form = match extension.to_ascii_lowercase().as_str() {
            "svg" => Form::Svg,
            "png" => Form::Png,
            _ => return Err("expected a file name ending in .svg or .png".to_owned()),
        };
        Ok(Self { path, form })
    }

    /// Parses the value of an option.
    pub(crate) fn parser() -> impl TypedValueParser<Value = Self> {
        PathBufValueParser::new().try_map(Self::new)
    }

    /// The file and its content.
    pub(crate) fn with(&self, sheet: &Sheet) -> anyhow::Result<(PathBuf, Vec<u8>)> {
        Ok((self.path.clone(), self.form.render(sheet)?))
    }
}

/// Format of the figures of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum FigureForm {
    /// Vector graphics
    Svg,
    /// Bitmaps
    Png,
    /// No figures
    None,
}

/// Names and contents of the files with `sheets`.
pub(crate) fn figure_files(
    sheets: Vec<(&str, Sheet)>,
    form: FigureForm,
) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let (form, extension) = match form {
        FigureForm::Svg => (Form::Svg, "svg"),
        FigureForm::Png => (Form::Png, "png"),
        FigureForm::None => return Ok(Vec::new()),
    };
    let file = |(name, sheet): (&str, Sheet)| {
        let drawing = form
            .render(&sheet)
            .with_context(|| format!("drawing {name}"))?;
        Ok((format!("{name}.{extension}"), drawing))
    };
    sheets.into_iter().map(file).collect()
}
