//! What may help where something failed or is missing: options, by their names.

use serde::{Serialize, Serializer};

/// An option that may help. The library has it as a field, the command line as a flag, Python as a
/// keyword.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Remedy {
    /// Every star is listed.
    AllStars,
    /// Another catalogue.
    Catalog,
    /// When the frame was taken.
    Date,
    /// Horizontal field of view.
    Fov,
    /// One frame of several.
    Frame,
    /// Memory that a frame may take.
    MaxMemory,
    /// Direction of the frame's centre.
    Near,
    /// Angle of a pixel.
    PixelScale,
    /// Detection threshold.
    Sigma,
    /// How long a frame may take.
    TimeLimit,
}

impl Remedy {
    /// The option's name: words joined by underscores.
    pub const fn name(self) -> &'static str {
        match self {
            Self::AllStars => "all_stars",
            Self::Catalog => "catalog",
            Self::Date => "date",
            Self::Fov => "fov",
            Self::Frame => "frame",
            Self::MaxMemory => "max_memory",
            Self::Near => "near",
            Self::PixelScale => "pixel_scale",
            Self::Sigma => "sigma",
            Self::TimeLimit => "time_limit",
        }
    }
}

impl Serialize for Remedy {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// How a text calls options.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OptionNames {
    /// By the names of fields and keywords.
    #[default]
    Words,
    /// By the flags of the command line.
    Flags,
}

impl OptionNames {
    /// The name of an option.
    fn name(self, option: Remedy) -> String {
        match self {
            Self::Words => option.name().to_owned(),
            Self::Flags => format!("--{}", option.name().replace('_', "-")),
        }
    }

    /// What follows a text that these options may help: `; see sigma, max_memory`.
    pub fn see(self, options: &[Remedy]) -> String {
        if options.is_empty() {
            return String::new();
        }
        let names: Vec<String> = options.iter().map(|option| self.name(*option)).collect();
        format!("; see {}", names.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_called_as_their_reader_knows_them() {
        let options = [Remedy::PixelScale, Remedy::MaxMemory];
        assert_eq!(
            OptionNames::Words.see(&options),
            "; see pixel_scale, max_memory"
        );
        assert_eq!(
            OptionNames::Flags.see(&options),
            "; see --pixel-scale, --max-memory"
        );
        assert_eq!(OptionNames::Flags.see(&[]), "");
        let name = serde_json::to_string(&Remedy::TimeLimit).unwrap();
        assert_eq!(name, format!("\"{}\"", Remedy::TimeLimit.name()));
    }
}
