//! What files are that stand beside the frames in a folder.

/// What a file in a folder is, if it is no frame of the sky.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "as `text` says")]
pub enum OtherFile {
    Thumbnail,
    Keogram,
    Startrails,
    Panorama,
    Stack,
    Copy,
    Calibration,
    Video,
    OtherFormat,
    NoImage,
    Hidden,
    Product,
}

impl OtherFile {
    const ALL: [Self; 12] = [
        Self::Thumbnail,
        Self::Keogram,
        Self::Startrails,
        Self::Panorama,
        Self::Stack,
        Self::Copy,
        Self::Calibration,
        Self::Video,
        Self::OtherFormat,
        Self::NoImage,
        Self::Hidden,
        Self::Product,
    ];

    /// Code for programs.
    pub const fn code(self) -> &'static str {
        match self {
            Self::Thumbnail => "thumbnail",
            Self::Keogram => "keogram",
            Self::Startrails => "startrails",
            Self::Panorama => "panorama",
            Self::Stack => "stack",
            Self::Copy => "copy",
            Self::Calibration => "calibration",
            Self::Video => "video",
            Self::OtherFormat => "other_format",
            Self::NoImage => "no_image",
            Self::Hidden => "hidden",
            Self::Product => "product",
        }
    }

    /// That of a code.
    pub fn of_code(code: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.code() == code)
    }

    /// In words, for one and for several.
    pub const fn text(self) -> [&'static str; 2] {
        match self {
            Self::Thumbnail => ["thumbnail", "thumbnails"],
            Self::Keogram => ["keogram", "keograms"],
            Self::Startrails => ["picture of star trails", "pictures of star trails"],
            Self::Panorama => ["panorama", "panoramas"],
            Self::Stack => ["stack of frames", "stacks of frames"],
            Self::Copy => ["copy of a frame", "copies of frames"],
            Self::Calibration => ["dark, bias or flat", "darks, biases or flats"],
            Self::Video => ["video", "videos"],
            Self::OtherFormat => [
                "file in an unsupported format",
                "files in unsupported formats",
            ],
            Self::NoImage => ["file that is not an image", "files that are not images"],
            Self::Hidden => ["hidden file", "hidden files"],
            Self::Product => ["result of starpipe", "results of starpipe"],
        }
    }

    /// What one of the words of a name says.
    pub(super) fn of_word(word: &str) -> Option<Self> {
        Some(match word {
            "thumb" | "thumbs" | "thumbnail" | "thumbnails" => Self::Thumbnail,
            "keogram" | "keograms" => Self::Keogram,
            "startrail" | "startrails" => Self::Startrails,
            "panorama" | "panoramas" => Self::Panorama,
            "fieldsum" | "fieldsums" => Self::Stack,
            _ => return None,
        })
    }

    /// What two words after each other say.
    pub(super) fn of_words(words: &[String]) -> Option<Self> {
        let both = |one: &str, two: &str| words[0] == one && words[1] == two;
        if both("star", "trail") || both("star", "trails") {
            Some(Self::Startrails)
        } else if both("captured", "stack") || both("detected", "stack") || both("meteor", "stack")
        {
            Some(Self::Stack)
        } else {
            None
        }
    }
}
