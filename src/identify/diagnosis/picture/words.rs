//! Words: letters of one size side by side, as in a text, on a screen, or beside the stars of a planetarium.

use super::light::Light;
use super::shapes::Shape;

/// Letters are so high, in pixels.
const HEIGHT_PX: std::ops::RangeInclusive<f64> = 5.0..=48.0;
/// Fewest letters of a word: two or three spots in a row are stars.
const MIN_LETTERS: usize = 4;
/// Letters stand apart by less than this share of their height, …
const GAP: f64 = 0.55;
/// … and have nearly the same upper or lower end.
const UNEVEN: f64 = 0.22;
/// Shares of the highest contrast above which a pixel is ink.
const INK: [f32; 3] = [0.15, 0.35, 0.6];
/// Ink is above so many standard deviations of the noise.
const NOISE_SIGMA: f32 = 6.0;

/// What is written in a picture.
#[derive(Default)]
pub(super) struct Writing {
    /// Number of words, and of their letters.
    pub words: usize,
    pub letters: usize,
    /// Words that have another one beside them in their line.
    pub in_lines: usize,
    /// Regions that are no letters, but as high.
    pub others: usize,
    /// Whether the words stand in most parts of the picture.
    pub is_spread: bool,
}

/// The writing in a picture, at the contrast that shows most of it.
pub(super) fn read(light: &Light) -> Writing {
    let mut most = Writing::default();
    for sign in [1.0, -1.0] {
        let contrast = light.contrast(sign);
        for share in INK {
            let threshold = (share * contrast).max(NOISE_SIGMA * light.noise);
            let found = writing(&light.regions(sign, threshold), light);
            if found.letters > most.letters {
                most = found;
            }
        }
    }
    most
}

/// A word: where its letters are.
struct Word {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    letters: usize,
}

fn writing(regions: &[Shape], light: &Light) -> Writing {
    let is_letter = |shape: &&Shape| {
        HEIGHT_PX.contains(&shape.height()) && shape.width() < 2.5 * shape.height()
    };
    let mut letters: Vec<&Shape> = regions.iter().filter(is_letter).collect();
    letters.sort_by(|a, b| a.left.total_cmp(&b.left));
    let words = words(&letters);
    let count: usize = words.iter().map(|word| word.letters).sum();
    Writing {
        words: words.len(),
        letters: count,
        in_lines: words
            .iter()
            .filter(|word| has_neighbor(word, &words))
            .count(),
        others: letters.len() - count,
        is_spread: is_spread(&words, light),
    }
}

/// Chains of letters from left to right. Each letter is in one of them.
fn words(letters: &[&Shape]) -> Vec<Word> {
    let mut is_taken = vec![false; letters.len()];
    let mut words = Vec::new();
    for first in 0..letters.len() {
        if is_taken[first] {
            continue;
        }
        let mut chain = vec![first];
        while let Some(next) = next_letter(letters, chain[chain.len() - 1], &is_taken) {
            chain.push(next);
        }
        if chain.len() < MIN_LETTERS {
            continue;
        }
        let parts = || chain.iter().map(|&index| letters[index]);
        words.push(Word {
            left: letters[first].left,
            right: parts().map(|shape| shape.right).fold(f64::MIN, f64::max),
            top: parts().map(|shape| shape.top).fold(f64::MAX, f64::min),
            bottom: parts().map(|shape| shape.bottom).fold(f64::MIN, f64::max),
            letters: chain.len(),
        });
        chain.iter().for_each(|&index| is_taken[index] = true);
    }
    words
}

/// The letter to the right of one.
fn next_letter(letters: &[&Shape], index: usize, is_taken: &[bool]) -> Option<usize> {
    let this = letters[index];
    let farthest = this.right + 1.0 + GAP * this.height();
    let to_the_right = letters.iter().enumerate().skip(index + 1);
    to_the_right
        .take_while(|(_, other)| other.left <= farthest)
        .find(|(next, other)| {
            !is_taken[*next] && other.left > this.middle[0] && is_in_line(this, other)
        })
        .map(|(next, _)| next)
}

fn is_in_line(this: &Shape, other: &Shape) -> bool {
    let tall = this.height().max(other.height());
    let uneven = (UNEVEN * tall).max(1.0);
    let is_alike = tall < 2.0 * this.height().min(other.height());
    let ends = [other.top - this.top, other.bottom - this.bottom];
    is_alike && ends.iter().any(|apart| apart.abs() <= uneven)
}

/// Whether another word stands beside one in its line.
fn has_neighbor(word: &Word, words: &[Word]) -> bool {
    let height = word.bottom - word.top;
    words.iter().any(|other| {
        let gap = (other.left - word.right).max(word.left - other.right);
        let is_level = (other.bottom - word.bottom).abs() < 0.5 * height;
        gap > 0.0 && gap < 6.0 * height && is_level
    })
}

/// Whether words are in three quarters of the picture: a date or a name may be in a corner of any photograph.
fn is_spread(words: &[Word], light: &Light) -> bool {
    let mut quarters = [false; 4];
    for word in words {
        let is_right = word.left > light.frame.width as f64 / 2.0;
        let is_low = word.top > light.frame.height as f64 / 2.0;
        quarters[usize::from(is_right) + 2 * usize::from(is_low)] = true;
    }
    quarters.iter().filter(|&&has| has).count() >= 3
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Frame;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A dark picture with bright letters `size` high whose left upper corners are at these places: an upright
    /// stroke, and a foot.
    fn picture(places: impl Iterator<Item = [usize; 2]>, size: usize) -> Light {
        let mut levels = vec![20.0; 600 * 400];
        for [left, top] in places {
            for y in 0..size {
                let end = if y + 2 < size { 2 } else { 2 * size / 3 };
                for x in 0..end {
                    levels[(top + y) * 600 + left + x] = 200.0;
                }
            }
        }
        Light::of(
            &Frame::new(600, 400, levels)
                .unwrap()
                .with_levels(1.0, Some(255.0)),
        )
    }

    #[test]
    fn letters_side_by_side_are_words_and_words_stand_in_lines() {
        for size in [8, 12, 20] {
            // Words of six letters, in lines.
            let letter = |index: usize| {
                let (line, place) = (index / 12, index % 12);
                [
                    20 + place * (size - 2) + place / 6 * size,
                    20 + line * 2 * size,
                ]
            };
            let found = read(&picture((0..84).map(letter), size));
            assert_eq!(
                (found.words, found.letters, found.in_lines),
                (14, 84, 14),
                "{size}"
            );
        }
    }

    #[test]
    fn strewn_spots_are_no_words() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for count in [30, 150, 400] {
            let places: Vec<[usize; 2]> = (0..count)
                .map(|_| [random.random_range(5..580), random.random_range(5..380)])
                .collect();
            let found = read(&picture(places.into_iter(), 7));
            assert!(found.words <= count / 40, "{count}: {}", found.words);
        }
    }
}
