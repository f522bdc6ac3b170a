//! The files of an input: their names, and whether they may be written.

use super::args::{Existing, OutputNames};
use crate::cli::output::files::remove_outdated;
use starpipe::report::tables::TableFormat;
use std::path::{Path, PathBuf};

/// What a file has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Content {
    /// The detections, whether they are identified or not.
    Sources,
    Table(TableFormat),
    Wcs,
    NewFits,
    /// The mark that it is solved, which is written last.
    Solved,
}

/// An input and its files.
#[derive(Debug)]
pub(super) struct Job {
    pub(super) input: PathBuf,
    /// Whether it is a list of centroids.
    pub(super) is_list: bool,
    /// What is printed first.
    pub(super) title: String,
    pub(super) outputs: Vec<(Content, PathBuf)>,
    /// Files that tell that it was solved before.
    solved: Vec<PathBuf>,
}

impl AsRef<Path> for Job {
    fn as_ref(&self) -> &Path {
        &self.input
    }
}

impl Job {
    pub(super) fn new(input: PathBuf, is_list: bool, names: &OutputNames) -> Self {
        let base = base(&input, names);
        let path_of = |name: &Option<String>, usual: &str| {
            let name = name.as_deref().unwrap_or(usual);
            (name != "none").then(|| PathBuf::from(name.replace("%s", &base)))
        };
        let tables = [
            (TableFormat::Match, path_of(&names.match_file, "%s.match")),
            (TableFormat::Rdls, path_of(&names.rdls, "%s.rdls")),
            (TableFormat::Corr, path_of(&names.corr, "%s.corr")),
            (
                TableFormat::IndexXyls,
                path_of(&names.index_xyls, "%s-indx.xyls"),
            ),
        ];
        let axy = path_of(&names.axy, "%s.axy").filter(|_| !names.temp_axy);
        let solved = path_of(&names.solved, "%s.solved");
        let all = [
            (Content::Sources, axy),
            (Content::Sources, path_of(&names.keep_xylist, "none")),
        ];
        let tables = tables.map(|(format, path)| (Content::Table(format), path));
        let rest = [
            (Content::NewFits, path_of(&names.new_fits, "%s.new")),
            (Content::Wcs, path_of(&names.wcs, "%s.wcs")),
            (Content::Solved, solved.clone()),
        ];
        let all = all.into_iter().chain(tables).chain(rest);
        let outputs = all.filter_map(|(content, path)| Some((content, path?)));
        Self {
            outputs: outputs.collect(),
            solved: [path_of(&names.solved_in, "none"), solved]
                .into_iter()
                .flatten()
                .collect(),
            input,
            is_list,
            title: String::new(),
        }
    }

    /// The same, with what is printed first.
    pub(super) fn titled(self, title: String) -> Self {
        Self { title, ..self }
    }

    /// Why it is passed over, for people.
    pub(super) fn refusal(&self, existing: &Existing) -> Option<String> {
        let mut before = self.solved.iter();
        let before = before.find(|path| existing.skip_solved && path.exists());
        if let Some(path) = before {
            let path = path.display();
            return Some(format!(
                "Solved file exists: {path}; skipping this input file.\n"
            ));
        }
        let paths = || self.outputs.iter().map(|(_, path)| path);
        if let Some(path) = paths().find(|path| **path == self.input) {
            return Some(format!(
                "Output filename \"{}\" is the same as your input file.\nRefusing to continue.\n\
                 You can either choose a different output filename, or\n\
                 rename your input file to have a different extension.\n",
                path.display()
            ));
        }
        if existing.overwrite || existing.continues {
            return None;
        }
        let path = paths().find(|path| path.exists())?;
        Some(format!(
            "Output file already exists: \"{}\".\n\
             Use the --overwrite flag to overwrite existing files,\n \
             or the --continue  flag to not overwrite existing files but still try solving.\n\
             Continuing to next input file.\n",
            path.display()
        ))
    }

    /// Removes the files of an earlier run, so that none is left if it is not solved now.
    pub(super) fn remove_old(&self) -> anyhow::Result<()> {
        let mut paths = self.outputs.iter().map(|(_, path)| path);
        paths.try_for_each(|path| remove_outdated(path).map(|_| ()))
    }
}

/// What the names of files begin with: the directory and the name of the input, or what is stated, without its
/// extension.
///
/// # Reference
/// astrometry.net 0.93, `solve-field.c`: an extension has two to four characters.
fn base(input: &Path, names: &OutputNames) -> String {
    let file = input.file_name().unwrap_or(input.as_os_str());
    let own = || file.to_string_lossy().into_owned();
    let name = names.out.clone().unwrap_or_else(own);
    let beside = || match input.parent() {
        Some(parent) if parent != Path::new("") => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    let directory = names.dir.clone().unwrap_or_else(beside);
    let base = format!("{}/{name}", directory.display());
    let base = [".gz", ".bz2"]
        .iter()
        .find_map(|end| base.strip_suffix(end))
        .unwrap_or(&base);
    let is_extension = |end: &str| (2..=4).contains(&end.len()) && !end.contains('/');
    match base.rsplit_once('.') {
        Some((start, end)) if is_extension(end) => start.to_owned(),
        _ => base.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_input_without_its_extension() {
        let names = OutputNames::default();
        for (input, expected) in [
            ("a.fits", "./a"),
            ("night/a.b.fits.gz", "night/a.b"),
            ("/d/a.jpeg", "/d/a"),
            ("/d.e/image", "/d.e/image"),
            ("a.c", "./a.c"),
            ("a.fits.fz", "./a.fits"),
        ] {
            assert_eq!(base(Path::new(input), &names), expected);
        }
        let stated = OutputNames {
            dir: Some("/tmp/x".into()),
            out: Some("solved.1".to_owned()),
            ..OutputNames::default()
        };
        assert_eq!(base(Path::new("night/a.fits"), &stated), "/tmp/x/solved.1");
    }

    #[test]
    fn none_is_no_file_and_names_that_are_stated_are_paths() {
        let names = OutputNames {
            dir: Some("/tmp/x".into()),
            wcs: Some("/tmp/solution.wcs".to_owned()),
            rdls: Some("none".to_owned()),
            corr: Some("%s-pairs.fits".to_owned()),
            temp_axy: true,
            ..OutputNames::default()
        };
        let job = Job::new("a.fits".into(), false, &names);
        let path_of = |wanted| {
            let mut outputs = job.outputs.iter();
            let output = outputs.find(|(content, _)| *content == wanted);
            output.map(|(_, path)| path.to_str().unwrap())
        };
        assert_eq!(path_of(Content::Wcs), Some("/tmp/solution.wcs"));
        let corr = path_of(Content::Table(TableFormat::Corr));
        assert_eq!(corr, Some("/tmp/x/a-pairs.fits"));
        assert_eq!(path_of(Content::Table(TableFormat::Rdls)), None);
        assert_eq!(path_of(Content::Sources), None);
        assert_eq!(path_of(Content::Solved), Some("/tmp/x/a.solved"));
    }
}
