//! What is no frame of the sky in a folder of them, as programs for all-sky cameras leave it.
//!
//! The rules, in their order. Those from the fifth on hold beside [`MIN_FRAMES`] pictures of one size or more,
//! which are the frames: the sizes in which there are more pixels in all than in any other.
//!
//! | what | by |
//! |---|---|
//! | hidden file | a name that begins with a dot |
//! | product of starpipe, video, other format, no image | first bytes; extension of a video that has none |
//! | frame for calibration | `IMAGETYP`, `FRAME` or `OBSTYPE` in the header of a FITS file: dark, bias or flat |
//! | copy | the same bytes as another frame, in a night |
//! | thumbnail, keogram, star trails, panorama, stack | a word of the name or the folder that the frames' lack |
//! | thumbnail | at most half as wide and high as a frame with the same name or time, or of one camera and of the same shape |
//! | keogram | of one camera, and another shape |
//!
//! A file that is named as an image and is none, or is damaged, counts as a frame: reading it tells why.
//!
//! # Reference
//! Names: AllskyTeam/allsky (`image-20260115203000.jpg`, `thumbnails/`, `keogram/keogram-20260115.jpg`,
//! `startrails/startrails-20260115.jpg`, `allsky-20260115.mp4`), aaronwmorris/indi-allsky
//! (`allsky-keogram_ccd1_20260115_night.jpg`, `allsky-startrail_ccd1_20260115_night.jpg`),
//! CroatianMeteorNetwork/RMS (`XX0001_20260115_203000_captured_stack.jpg`, `_thumbs.jpg`, `_fieldsums.png`).

use super::directory::{all_files_in, head_of, other_kind, unsupported_file};
use super::error::FrameError;
use super::format::FrameFormat;
use super::limits::MAX_FILE_BYTES;
use super::other_file::OtherFile;
use super::tiff::TiffFile;
use crate::base::epoch::ObservationDate;
use crate::base::files;
use crate::base::panics::caught;
use image::ImageReader;
use memchr::memmem;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs::{self, File};
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::Xxh3;

/// Pictures of one size that are needed to tell what is no frame.
pub const MIN_FRAMES: usize = 3;
/// Folders below one without frames that are looked into: those of nights and hours.
const MAX_DEPTH: usize = 4;

/// Whose frames are in a folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cameras {
    /// Any.
    Any,
    /// One camera's.
    One,
    /// One camera's, each once.
    OneNight,
}

/// A file that is no frame of the sky.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PassedOver {
    /// The file.
    pub path: PathBuf,
    /// What it is.
    pub kind: OtherFile,
}

/// The frames in a folder, and what is none.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Folder {
    /// The frames, by name.
    pub frames: Vec<PathBuf>,
    /// The other files, by name.
    pub passed_over: Vec<PassedOver>,
}

impl Folder {
    /// The files in `directory`, or in the folders below it where it has no frames itself.
    ///
    /// # Errors
    /// As for [`files_in`](super::files_in).
    pub fn read(directory: &Path, cameras: Cameras) -> Result<Self, FrameError> {
        let files = files_below(directory, 0)
            .map_err(|error| FrameError::from(error).in_file(directory))?;
        let folder = Self::sorted(files, cameras);
        if !folder.frames.is_empty() {
            return Ok(folder);
        }
        let files: Vec<PathBuf> = folder
            .passed_over
            .into_iter()
            .map(|file| file.path)
            .collect();
        Err(unsupported_file(&files).unwrap_or_else(|| {
            let nothing = FrameError::NoFrames { files: files.len() };
            nothing.in_file(directory)
        }))
    }

    /// Frames and other files among `files`.
    pub fn sorted(files: Vec<PathBuf>, cameras: Cameras) -> Self {
        let mut passed_over = Vec::new();
        let mut pictures = Vec::new();
        for path in files {
            match other_kind(&path).or_else(|| calibration(&path)) {
                Some(kind) => passed_over.push(PassedOver { path, kind }),
                None => pictures.push(FolderImage::of(path)),
            }
        }
        let rules = Rules::from_pictures(&pictures, cameras);
        let mut frames = Vec::new();
        for picture in pictures {
            match rules.kind(&picture) {
                Some(kind) => passed_over.push(PassedOver {
                    path: picture.path,
                    kind,
                }),
                None => frames.push(picture.path),
            }
        }
        passed_over.sort_by(|a, b| a.path.cmp(&b.path));
        Self {
            frames,
            passed_over,
        }
    }
}

/// The files in a directory, and those in the folders below it if none of them is a frame.
fn files_below(directory: &Path, depth: usize) -> io::Result<Vec<PathBuf>> {
    let mut files = all_files_in(directory)?;
    if depth == MAX_DEPTH || files.iter().any(|path| other_kind(path).is_none()) {
        return Ok(files);
    }
    let mut folders = Vec::new();
    for entry in fs::read_dir(directory)? {
        let entry = entry?;
        // A link may lead back.
        if entry.file_type()?.is_dir() && !entry.file_name().to_string_lossy().starts_with('.') {
            folders.push(entry.path());
        }
    }
    folders.sort();
    for folder in folders {
        files.extend(files_below(&folder, depth + 1)?);
    }
    Ok(files)
}

/// Whether the header of a FITS file says that it is a dark, a bias or a flat.
fn calibration(path: &Path) -> Option<OtherFile> {
    const KEYWORDS: [&[u8]; 3] = [b"IMAGETYP= '", b"FRAME   = '", b"OBSTYPE = '"];
    const KINDS: [&str; 4] = ["dark", "bias", "flat", "zero"];
    let head = head_of(path).ok()?;
    if FrameFormat::detect(&head) != Some(FrameFormat::Fits) {
        return None;
    }
    let says = |keyword: &&[u8]| {
        let at = memmem::find(&head, keyword)? + keyword.len();
        let value = head[at..].split(|byte| *byte == b'\'').next()?;
        let value = String::from_utf8_lossy(value).to_ascii_lowercase();
        KINDS.iter().find(|kind| value.contains(**kind))
    };
    let found = KEYWORDS.iter().find_map(says);
    found.map(|_| OtherFile::Calibration)
}

/// What is known of an image before it is read.
struct FolderImage {
    path: PathBuf,
    /// Width and height, where the header tells them.
    size: Option<[u32; 2]>,
    by_name: Option<OtherFile>,
}

impl FolderImage {
    fn of(path: PathBuf) -> Self {
        Self {
            size: size_of(&path),
            by_name: kind_by_name(&path),
            path,
        }
    }

    /// Whether its header can be read, as far as it is looked at here.
    fn is_whole(&self) -> bool {
        let is_fits = || {
            head_of(&self.path)
                .is_ok_and(|head| FrameFormat::detect(&head) == Some(FrameFormat::Fits))
        };
        self.size.is_some() || is_fits()
    }

    /// What pictures of the same moment share: the time in the name, else the name.
    fn moment(&self) -> String {
        let date = ObservationDate::in_file_name(&self.path).filter(ObservationDate::has_time);
        let stem = || self.path.file_stem().unwrap_or_default().to_string_lossy();
        date.map_or_else(|| stem().into_owned(), |date| date.to_iso())
    }
}

/// Width and height in the header of a file.
fn size_of(path: &Path) -> Option<[u32; 2]> {
    let head = head_of(path).ok()?;
    if FrameFormat::detect(&head) == Some(FrameFormat::Fits) {
        // The axes of a compressed image are those of its table.
        if memmem::find(&head, b"XTENSION=").is_some() {
            return None;
        }
        let axis = |keyword: &[u8]| {
            let at = memmem::find(&head, keyword)? + keyword.len();
            let value = std::str::from_utf8(head.get(at..at + 20)?).ok()?;
            value.trim().parse().ok()
        };
        return Some([axis(b"NAXIS1  = ")?, axis(b"NAXIS2  = ")?]);
    }
    if FrameFormat::detect(&head) == Some(FrameFormat::Tiff) {
        return caught(|| size_of_tiff(path)).ok().flatten();
    }
    let read = || {
        let reader = ImageReader::new(BufReader::new(files::open(path).ok()?));
        let (width, height) = reader.with_guessed_format().ok()?.into_dimensions().ok()?;
        Some([width, height])
    };
    caught(read).ok().flatten()
}

/// That of the first image.
fn size_of_tiff(path: &Path) -> Option<[u32; 2]> {
    const WIDTH: u16 = 256;
    const HEIGHT: u16 = 257;
    let bytes = files::read(path, MAX_FILE_BYTES).ok()?;
    let first = TiffFile::parse(&bytes).ok()?.directories().next()?.ok()?;
    let side = |tag: u16| u32::try_from(first.first(tag, 0).ok()?).ok();
    Some([side(WIDTH)?, side(HEIGHT)?])
}

/// What a word of the file's name, or of its folder's, says.
fn kind_by_name(path: &Path) -> Option<OtherFile> {
    let folder = path.parent().and_then(Path::file_name);
    let names = [folder, path.file_stem()];
    names.into_iter().flatten().find_map(|name| {
        let name = name.to_string_lossy().to_lowercase();
        let words = name.split(|character: char| !character.is_alphabetic());
        let words: Vec<String> = words
            .filter(|word| !word.is_empty())
            .map(str::to_owned)
            .collect();
        let one = words.iter().find_map(|word| OtherFile::of_word(word));
        one.or_else(|| words.windows(2).find_map(OtherFile::of_words))
    })
}

/// What the frames of a folder are like, and what is told of the other pictures by it.
struct Rules {
    cameras: Cameras,
    /// Size of the frames, if there are enough of them.
    main: Option<[u32; 2]>,
    /// Whether frames without such a name are there.
    has_plain: bool,
    /// Moments of pictures of that size.
    moments: HashSet<String>,
    copies: HashSet<PathBuf>,
}

impl Rules {
    fn from_pictures(pictures: &[FolderImage], cameras: Cameras) -> Self {
        let plain = || pictures.iter().filter(|picture| picture.by_name.is_none());
        let mut counts: BTreeMap<[u32; 2], usize> = BTreeMap::new();
        let sizes = plain().filter_map(|picture| picture.size);
        for size in sizes.filter(|size| !size.contains(&0)) {
            *counts.entry(size).or_default() += 1;
        }
        let pixels = |(size, count): &([u32; 2], usize)| {
            let [width, height] = size.map(u64::from);
            (width * height).saturating_mul(*count as u64)
        };
        let main = counts
            .into_iter()
            .filter(|(_, count)| *count >= MIN_FRAMES)
            .max_by_key(pixels);
        let main = main.map(|(size, _)| size);
        let of_main = plain().filter(|picture| main.is_some() && picture.size == main);
        Self {
            cameras,
            main,
            has_plain: plain().count() >= MIN_FRAMES,
            moments: of_main.map(FolderImage::moment).collect(),
            copies: match cameras {
                Cameras::OneNight => copies(pictures),
                Cameras::One | Cameras::Any => HashSet::new(),
            },
        }
    }

    fn kind(&self, picture: &FolderImage) -> Option<OtherFile> {
        /// Ratios of width to height that are of one shape differ by this factor at most,
        const SAME_SHAPE: f64 = 1.05;
        /// and by this one at least if the shapes differ.
        const OTHER_SHAPE: f64 = 1.5;
        if self.copies.contains(&picture.path) {
            return Some(OtherFile::Copy);
        }
        if let Some(kind) = picture.by_name.filter(|_| self.has_plain) {
            return Some(kind);
        }
        let (size, main) = (picture.size.filter(|size| !size.contains(&0))?, self.main?);
        let ratio = aspect(size) / aspect(main);
        let unlike = ratio.max(ratio.recip());
        let is_small = size[0] <= main[0] / 2 && size[1] <= main[1] / 2;
        let is_of_one = self.cameras != Cameras::Any;
        if is_small
            && (self.moments.contains(&picture.moment()) || is_of_one && unlike < SAME_SHAPE)
        {
            Some(OtherFile::Thumbnail)
        } else {
            (is_of_one && unlike > OTHER_SHAPE).then_some(OtherFile::Keogram)
        }
    }
}

/// The longer side over the shorter one: a camera may be turned.
fn aspect([width, height]: [u32; 2]) -> f64 {
    f64::from(width.max(height)) / f64::from(width.min(height))
}

/// The pictures with the same bytes as another one. Of these, the one with a date in its name is the frame, or
/// else the first by name. Damaged files that are alike are not: reading each tells why.
fn copies(pictures: &[FolderImage]) -> HashSet<PathBuf> {
    let mut by_length: HashMap<u64, Vec<&Path>> = HashMap::new();
    for picture in pictures.iter().filter(|picture| picture.is_whole()) {
        let length = fs::metadata(&picture.path).map_or(0, |found| found.len());
        by_length.entry(length).or_default().push(&picture.path);
    }
    by_length.remove(&0);
    let mut copies = HashSet::new();
    for alike in by_length.values() {
        for alike in grouped(alike, ends_hash) {
            for mut same in grouped(&alike, content_hash) {
                same.sort_by_key(|path| (ObservationDate::in_file_name(path).is_none(), *path));
                copies.extend(same[1..].iter().map(|path| path.to_path_buf()));
            }
        }
    }
    copies
}

/// Those of `paths` whose hashes are alike, in groups of two or more.
fn grouped<'p>(paths: &[&'p Path], hash: fn(&Path) -> io::Result<u64>) -> Vec<Vec<&'p Path>> {
    if paths.len() < 2 {
        return Vec::new();
    }
    let mut groups: BTreeMap<u64, Vec<&Path>> = BTreeMap::new();
    for path in paths {
        if let Ok(hash) = hash(path) {
            groups.entry(hash).or_default().push(path);
        }
    }
    groups
        .into_values()
        .filter(|group| group.len() > 1)
        .collect()
}

/// Hash of the first and the last bytes of a file.
fn ends_hash(path: &Path) -> io::Result<u64> {
    const BYTES: u64 = 1 << 15;
    let mut file = files::open(path)?;
    let length = file.metadata()?.len();
    let mut hash = Xxh3::new();
    hash_of(&mut file, BYTES, &mut hash)?;
    file.seek(SeekFrom::Start(length.saturating_sub(BYTES)))?;
    hash_of(&mut file, BYTES, &mut hash)?;
    Ok(hash.digest())
}

fn content_hash(path: &Path) -> io::Result<u64> {
    let mut hash = Xxh3::new();
    hash_of(&mut files::open(path)?, u64::MAX, &mut hash)?;
    Ok(hash.digest())
}

fn hash_of(file: &mut File, limit: u64, hash: &mut Xxh3) -> io::Result<()> {
    let mut buffer = vec![0; 1 << 15];
    let mut file = file.take(limit);
    loop {
        let read = file.read(&mut buffer)?;
        if read == 0 {
            return Ok(());
        }
        hash.update(&buffer[..read]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder with gray pictures of these names and sizes, and what is passed over in it.
    struct Drawn(tempfile::TempDir);

    impl Drawn {
        fn new() -> Self {
            Self(tempfile::tempdir().unwrap())
        }

        fn picture(&self, name: &str, [width, height]: [u32; 2]) -> &Self {
            // No two are alike.
            let level = xxhash_rust::xxh3::xxh3_64(name.as_bytes()).to_le_bytes();
            let pixel = |x: u32, y: u32| image::Luma([level[((x + y) % 8) as usize]]);
            let path = self.0.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            image::GrayImage::from_fn(width, height, pixel)
                .save(path)
                .unwrap();
            self
        }

        fn file(&self, name: &str, bytes: &[u8]) -> &Self {
            fs::write(self.0.path().join(name), bytes).unwrap();
            self
        }

        fn frames(&self, count: usize) -> &Self {
            for minute in 0..count {
                self.picture(&format!("image-2026011520{minute:02}00.png"), [64, 48]);
            }
            self
        }

        fn sorted(&self, cameras: Cameras) -> (Vec<String>, Vec<(String, &'static str)>) {
            let folder = Folder::read(self.0.path(), cameras).unwrap();
            let name = |path: &Path| {
                let below = path.strip_prefix(self.0.path()).unwrap();
                below.to_string_lossy().replace('\\', "/")
            };
            let frames = folder.frames.iter().map(|path| name(path)).collect();
            let others = folder.passed_over.iter();
            let others = others.map(|other| (name(&other.path), other.kind.code()));
            (frames, others.collect())
        }

        fn others(&self, cameras: Cameras) -> Vec<(String, &'static str)> {
            self.sorted(cameras).1
        }
    }

    #[test]
    fn what_all_sky_programs_leave_is_told_by_kind() {
        let folder = Drawn::new();
        folder.frames(4);
        folder.picture("image.png", [64, 48]);
        fs::copy(
            folder.0.path().join("image-20260115200300.png"),
            folder.0.path().join("image.png"),
        )
        .unwrap();
        folder.picture("keogram-20260115.png", [64, 48]);
        folder.picture("allsky-startrail_ccd1_20260115_night.png", [64, 48]);
        folder.picture("strip.png", [64, 12]);
        folder.picture("turned.png", [48, 64]);
        folder.picture("small.png", [16, 12]);
        folder.file("allsky-20260115.mp4", b"\0\0\0\x18ftypisom\0\0\0\0isom");
        folder.file("x.mkv", b"\x1a\x45\xdf\xa3");
        folder.file("unfinished.mp4", b"");
        folder.file("config.json", b"{}");
        folder.file("web.webp", b"RIFF\x24\0\0\0WEBPVP8 ");
        folder.file(".DS_Store", b"\0").file("._image.png", b"\0");
        folder.file(
            "d.fits",
            b"SIMPLE  =                    T / \nFRAME   = 'Dark'",
        );
        folder
            .file("empty.jpg", b"")
            .file("cut.jpg", b"\xff\xd8\xff\xe0");
        let (frames, others) = folder.sorted(Cameras::OneNight);
        assert_eq!(frames.len(), 4 + 3, "{frames:?}");
        let expected = [
            ("._image.png", "hidden"),
            (".DS_Store", "hidden"),
            ("allsky-20260115.mp4", "video"),
            ("allsky-startrail_ccd1_20260115_night.png", "startrails"),
            ("config.json", "no_image"),
            ("d.fits", "calibration"),
            ("image.png", "copy"),
            ("keogram-20260115.png", "keogram"),
            ("small.png", "thumbnail"),
            ("strip.png", "keogram"),
            ("unfinished.mp4", "video"),
            ("web.webp", "other_format"),
            ("x.mkv", "video"),
        ];
        let mut expected = expected.map(|(name, kind)| (name.to_owned(), kind));
        expected.sort();
        assert_eq!(others, expected);
    }

    #[test]
    fn of_any_cameras_only_names_and_moments_tell() {
        let folder = Drawn::new();
        folder.frames(3);
        folder.picture("strip.png", [64, 12]);
        folder.picture("small.png", [16, 12]);
        folder.picture("small-2026-01-15_20-01-00.png", [16, 12]);
        folder.picture("thumb_7.png", [16, 12]);
        let others = folder.others(Cameras::Any);
        let others: Vec<_> = others
            .iter()
            .map(|(name, kind)| (name.as_str(), *kind))
            .collect();
        let expected = [
            ("small-2026-01-15_20-01-00.png", "thumbnail"),
            ("thumb_7.png", "thumbnail"),
        ];
        assert_eq!(others, expected);
    }

    #[test]
    fn damaged_files_with_the_same_bytes_are_no_copies() {
        let folder = Drawn::new();
        folder.frames(4);
        for name in ["a.jpg", "b.jpg"] {
            folder.file(name, b"\xff\xd8\xff\xe0 no more");
        }
        let (frames, others) = folder.sorted(Cameras::OneNight);
        assert_eq!(frames.len(), 6);
        assert_eq!(others, []);
    }

    #[test]
    fn names_alone_tell_nothing_where_there_are_no_other_frames() {
        let folder = Drawn::new();
        for number in 0..4 {
            folder.picture(&format!("startrails-{number}.png"), [64, 48]);
        }
        folder.picture("other.png", [64, 12]);
        assert_eq!(folder.sorted(Cameras::One).1, []);
        let two = Drawn::new();
        two.frames(2).picture("small.png", [16, 12]);
        assert_eq!(two.sorted(Cameras::One).1, []);
    }

    #[test]
    fn frames_are_looked_for_below_a_folder_without_any() {
        let folder = Drawn::new();
        folder.file_below("night/15_20/ccd1_20260115_2000");
        folder.picture("thumbnails/ccd1_20260115_200000.png", [16, 12]);
        let (frames, others) = folder.sorted(Cameras::One);
        assert_eq!(frames.len(), 4);
        assert_eq!(others.len(), 1);
        folder.picture("here.png", [64, 48]);
        assert_eq!(folder.sorted(Cameras::One).0, ["here.png"]);
    }

    impl Drawn {
        fn file_below(&self, start: &str) {
            for second in 0..4 {
                self.picture(&format!("{start}0{second}.png"), [64, 48]);
            }
        }
    }
}
