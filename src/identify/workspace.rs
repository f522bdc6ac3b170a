//! Identification of one star field in two parts: where the camera points, then which star is
//! which, with the final fit to all of them.

use crate::base::coords::{Camera, Icrs, Rotation, UnitVector};
use crate::base::interrupt::Interrupt;
use crate::base::units::RAD_PER_DEG;
use crate::camera::KnownLens;
use crate::camera::{CameraModel, DistortionModel};
use crate::ephemeris::places::StarPlaces;
use crate::identify::effort::Effort;
use crate::identify::field::{OtherFields, StarField};
use crate::identify::fit::{NamingStart, Refined, Start};
use crate::identify::hypothesis::Problem;
use crate::identify::identification::{Identification, MIN_STARS, SearchFailure, StarMatch};
use crate::identify::index::IndexedCatalog;
use crate::identify::naming::Posed;
use crate::identify::pairing::Pair;
use crate::identify::priors::Priors;
use crate::identify::search::{
    FoundHypothesis, LOG10_FALSE_ALARM_LIMIT, LOG10_SURE, SearchBuffers, SearchPlan, SearchWindow,
    Thinning, Tiers, TriangleSearch, Windows,
};
use std::f64::consts::PI;
use std::sync::Arc;

/// Numbers of stars, the brightest, that decide how much distortion is fitted. Where most
/// detections are none, the fewer brightest have less chance pairs among them.
const CALIBRATION_STARS: [usize; 3] = [120, 30, 12];
/// First pairing radius of the final fit, in units of the frame's diagonal, and the largest for few
/// stars, …
const FINAL_RADIUS_FRACTION: f64 = 0.005;
const MAX_RADIUS_FRACTION: f64 = 0.0125;
/// … which chance reaches for this share of the stars.
const CHANCE_PAIRS: f64 = 0.02;
/// A fit is good if it names this share of the stars that it began with.
const GOOD_FRACTION: f64 = 0.5;

/// Stars that an attitude alone is fitted to, the brightest; more where it took more to find it.
const ATTITUDE_STARS: usize = 100;

/// A name is given where the odds that it is right are at least these, unless others are stated.
pub const NAME_ODDS: f64 = 100.0;

/// Identifies the stars of `field`. For many fields, [`Workspace::identify`] does the same without
/// allocating.
///
/// # Errors
/// The [`SearchFailure`] where they are not identified.
///
/// # Example
/// ```
/// use starpipe::ephemeris::places::StarPlaces;
/// use starpipe::detect::{self, Detection, DetectConfig, detect};
/// use starpipe::identify::{ObservedStar, Photometry, SourceIndex, StarField};
/// use starpipe::{Catalog, IndexedCatalog, Priors, frame, identify};
///
/// let frame = frame::read("fixtures/orion/orion.png")?;
/// let detections = detect(&frame, &DetectConfig::default(), &mut detect::Workspace::new())?;
/// let observed = |(index, source): (usize, &Detection)| ObservedStar {
///     source: SourceIndex::new(index),
///     position: source.position,
///     sigma_px: source.sigma_x_px.max(source.sigma_y_px),
///     mag: -2.5 * source.flux_adu.log10(),
///     is_saturated: source.flags.saturated,
/// };
/// let field = StarField {
///     width_px: frame.width as f64,
///     height_px: frame.height as f64,
///     photometry: Photometry::Instrumental,
///     places: StarPlaces::default(),
///     spot_sigma_px: Some(detections.spot_sigma_px),
///     sky_area: None,
///     stars: detections.sources.iter().enumerate().map(observed).collect(),
/// };
/// // The stars to V 7 are enough for wide fields, and are indexed in a moment.
/// let catalog = Catalog::built_in().limited_to(7.0);
/// let indexed = IndexedCatalog::build(&catalog, &|_| ());
/// let found = identify(&field, &Priors::default(), &indexed).expect("the stars are identified");
/// assert!(found.matches.len() > 100 && found.log10_false_alarm < -100.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn identify(
    field: &StarField,
    priors: &Priors,
    sky: &IndexedCatalog,
) -> Result<Identification, SearchFailure> {
    Workspace::new().identify(field, priors, sky).cloned()
}

/// Buffers for identification, reused from field to field: after the largest field nothing is
/// allocated.
#[derive(Debug)]
pub struct Workspace {
    name_odds: f64,
    effort: Effort,
    buffers: SearchBuffers,
    others: Others,
    bright: Brightest,
    answer: Option<Identification>,
}

impl Default for Workspace {
    fn default() -> Self {
        Self::new()
    }
}

impl Workspace {
    /// Empty buffers; names of [`NAME_ODDS`].
    pub fn new() -> Self {
        Self {
            name_odds: NAME_ODDS,
            effort: Effort::Normal,
            buffers: SearchBuffers::default(),
            others: Others::default(),
            bright: Brightest::default(),
            answer: None,
        }
    }

    /// From the next field on, a name is given where the odds that it is right are at least `odds` to
    /// 1. Names less sure than 1 to 1 are never given: a star would have several.
    pub fn set_name_odds(&mut self, odds: f64) {
        self.name_odds = odds.max(1.0);
    }

    /// From the next field on, searches do as much as `effort` says.
    pub fn set_effort(&mut self, effort: Effort) {
        self.effort = effort;
    }

    /// From the next field on, this lens is held, in fields of its size.
    pub fn set_known_lens(&mut self, lens: Option<&Arc<KnownLens>>) {
        self.buffers.refiner.set_known_lens(lens);
    }

    /// Searches end with [`SearchFailure::Interrupted`] when `interrupt` is due.
    #[must_use]
    pub fn with_interrupt(mut self, interrupt: Interrupt) -> Self {
        self.set_interrupt(interrupt);
        self
    }

    /// [`with_interrupt`](Self::with_interrupt), from the next field on.
    pub(crate) fn set_interrupt(&mut self, interrupt: Interrupt) {
        self.buffers.interrupt = interrupt;
    }

    /// Identifies the stars of `field`: [`find_pointing`](Self::find_pointing), then
    /// [`name_stars`](PointedField::name_stars). The answer is kept in the workspace.
    ///
    /// # Errors
    /// The [`SearchFailure`] where they are not identified.
    pub fn identify(
        &mut self,
        field: &StarField,
        priors: &Priors,
        sky: &IndexedCatalog,
    ) -> Result<&Identification, SearchFailure> {
        self.find_pointing(field, priors, sky)?.name_stars()
    }

    /// Attitude and optics alone, from the brightest stars of `field`:
    /// [`find_pointing`](Self::find_pointing), then [`attitude`](PointedField::attitude). The answer is kept in the workspace.
    ///
    /// # Errors
    /// The [`SearchFailure`] where the pointing is not found.
    pub fn attitude(
        &mut self,
        field: &StarField,
        priors: &Priors,
        sky: &IndexedCatalog,
    ) -> Result<&Identification, SearchFailure> {
        self.find_pointing(field, priors, sky)?.attitude()
    }

    /// [`attitude`](Self::attitude), where few triangles show it beyond doubt, those that are `tried` at once: what is
    /// searched after this adds its whole false-alarm probability, and this next to nothing.
    ///
    /// # Errors
    /// The [`SearchFailure`] where they do not.
    pub(crate) fn attitude_at_once(
        &mut self,
        field: &StarField,
        priors: &Priors,
        sky: &IndexedCatalog,
        tried: Choices,
    ) -> Result<&mut Identification, SearchFailure> {
        let pointed = self.find_pointing_by(tried, field, priors, sky)?;
        if pointed.found.log10_false_alarm > LOG10_SURE {
            return Err(pointed.failure);
        }
        pointed.attitude_mut()
    }

    /// The last answer.
    pub(crate) fn answer(&self) -> Option<&Identification> {
        self.answer.as_ref()
    }

    /// Finds out where the camera points, from the brightest stars of `field`, and no more.
    ///
    /// # Errors
    /// The [`SearchFailure`] where the pointing is not found.
    pub fn find_pointing<'w: 'a, 'a>(
        &'w mut self,
        field: &'a StarField,
        priors: &Priors,
        sky: &'a IndexedCatalog<'a>,
    ) -> Result<PointedField<'w, 'a>, SearchFailure> {
        self.find_pointing_by(Choices::OfField, field, priors, sky)
    }

    /// [`find_pointing`](Self::find_pointing) from these choices of stars.
    pub(crate) fn find_pointing_by<'w: 'a, 'a>(
        &'w mut self,
        tried: Choices<'a>,
        field: &'a StarField,
        priors: &Priors,
        sky: &'a IndexedCatalog<'a>,
    ) -> Result<PointedField<'w, 'a>, SearchFailure> {
        #[cfg(debug_assertions)]
        super::planted::panic_if_asked(field);
        if field.stars.len() < MIN_STARS {
            return Err(SearchFailure::TooFewStars {
                found: field.stars.len(),
                needed: MIN_STARS,
            });
        }
        let Self {
            name_odds,
            effort,
            buffers,
            others,
            bright,
            answer,
        } = self;
        let whole = Problem::new(field, sky);
        let first = match tried {
            Choices::AtOnce => SearchPlan::at_once(),
            Choices::PartsAtOnce => SearchPlan::NOTHING,
            Choices::OfField | Choices::OfFrame(_) => SearchPlan::quick(*effort),
        };
        let mut search = TriangleSearch::new(whole, first, priors, *effort, buffers);
        let mut found = search.run();
        let mut best_log10 = search.best_log10_false_alarm();
        if found.is_none() && !search.is_interrupted() {
            let further = Further { whole, priors };
            let (next, of_others) = match tried {
                Choices::AtOnce | Choices::PartsAtOnce => {
                    further.search(search, others.middle(whole))
                }
                Choices::OfField => further.search(search, others.choices(whole, None, *effort)),
                Choices::OfFrame(frame) => {
                    further.search(search, others.choices(whole, Some(frame), *effort))
                }
            };
            search = next;
            FoundFurther { found, best_log10 } = of_others;
        }
        let failure = if search.is_interrupted() {
            SearchFailure::Interrupted
        } else {
            SearchFailure::NoMatch {
                best_log10_false_alarm: best_log10,
            }
        };
        let found = found.ok_or(failure)?;
        Ok(PointedField {
            most_chance: 1.0 / (1.0 + *name_odds),
            problem: whole,
            found,
            search,
            failure: SearchFailure::NotConfirmed {
                log10_false_alarm: found.log10_false_alarm,
            },
            bright,
            answer,
        })
    }
}

/// What is searched, one after the other.
#[derive(Clone, Copy)]
pub(crate) enum Choices<'a> {
    /// Few triangles of the brightest stars of a field, and of its middle.
    AtOnce,
    /// The middle of a field alone.
    PartsAtOnce,
    /// The brightest stars of a field, and others of its stars.
    OfField,
    /// The same, and the stars of the frame, detected otherwise.
    OfFrame(&'a dyn OtherFields),
}

/// What is searched besides the brightest stars of a field. Its buffers are reused.
#[derive(Debug, Default)]
struct Others {
    thinning: Thinning,
    tiers: Tiers,
    windows: Windows,
    windows_of_brightest: Windows,
}

impl Others {
    /// The middle of the frame, where an answer is wanted at once.
    fn middle<'w: 'a, 'a>(
        &'w mut self,
        whole: Problem<'a>,
    ) -> impl Iterator<Item = FurtherSearch<'a>> {
        middle(self.windows.cut(whole.field), whole)
    }

    /// What is searched besides: what costs little first.
    fn choices<'w: 'a, 'a>(
        &'w mut self,
        whole: Problem<'a>,
        other_fields: Option<&'a dyn OtherFields>,
        effort: Effort,
    ) -> impl Iterator<Item = FurtherSearch<'a>> {
        let Self {
            thinning,
            tiers,
            windows,
            windows_of_brightest,
        } = self;
        let windows = windows.cut(whole.field);
        let of_middle = middle(windows, whole);
        let of = move |field| Problem { field, ..whole };
        let few = other_fields.and_then(|other_fields| other_fields.few_brightest());
        let few = few.map(|few| FurtherSearch::new(of(few), SearchPlan::at_once()));
        // Many are measured only where the few do not tell it.
        let many = std::iter::once_with(move || {
            let many = other_fields.and_then(|other_fields| other_fields.many_brightest());
            let of_middle = many.map(|many| middle(windows_of_brightest.cut(many), of(many)));
            of_middle.into_iter().flatten()
        });
        let coarse = other_fields.into_iter().flat_map(move |other_fields| {
            let fields = (0..other_fields.resolutions())
                .filter_map(move |number| other_fields.at_resolution(number));
            fields.map(move |field| FurtherSearch::new(of(field), SearchPlan::coarse(effort)))
        });
        let of_whole = std::iter::once(FurtherSearch::new(whole, SearchPlan::votes(effort)));
        let windows = windows.iter().map(move |window| {
            let plan = if window.is_main {
                SearchPlan::coarse(effort)
            } else {
                SearchPlan::window(effort)
            };
            FurtherSearch::of_window(window, whole, plan)
        });
        let thinned = thinning.thin(whole.field);
        let other_stars = SearchPlan::other_stars(effort);
        let thinned = thinned.map(move |field| FurtherSearch::new(of(field), other_stars));
        let tiers = tiers.below(whole.field, effort.tiers());
        let tiers = tiers.iter().map(move |tier| {
            let problem = Problem {
                brighter: tier.brighter,
                ..of(&tier.field)
            };
            FurtherSearch::new(problem, SearchPlan::tier(effort))
        });
        let of_brightest = few.into_iter().chain(many.flatten());
        let at_low_cost = of_brightest.chain(of_middle);
        let of_stars = coarse.chain(of_whole).chain(thinned);
        at_low_cost.chain(of_stars).chain(windows).chain(tiers)
    }
}

/// The windows in the middle of a frame, of which an answer is wanted at once.
fn middle<'a>(
    windows: &'a [SearchWindow],
    whole: Problem<'a>,
) -> impl Iterator<Item = FurtherSearch<'a>> {
    let central = windows.iter().filter(|window| window.is_central);
    central.map(move |window| FurtherSearch::of_window(window, whole, SearchPlan::at_once()))
}

/// What else is searched where the brightest stars of a field do not identify it.
struct FurtherSearch<'a> {
    problem: Problem<'a>,
    plan: SearchPlan,
    /// The window of the frame that it is.
    window: Option<&'a SearchWindow>,
}

impl<'a> FurtherSearch<'a> {
    fn new(problem: Problem<'a>, plan: SearchPlan) -> Self {
        Self {
            problem,
            plan,
            window: None,
        }
    }

    fn of_window(window: &'a SearchWindow, whole: Problem<'a>, plan: SearchPlan) -> Self {
        let problem = Problem {
            field: &window.field,
            ..whole
        };
        Self {
            window: Some(window),
            ..Self::new(problem, plan)
        }
    }
}

/// Searches for the pointing of a `whole` frame in choices of its stars.
#[derive(Clone, Copy)]
struct Further<'a, 'p> {
    whole: Problem<'a>,
    priors: &'p Priors,
}

/// What was found in some of them, and the lowest log10 of the false-alarm probabilities, those before among them.
struct FoundFurther {
    found: Option<FoundHypothesis>,
    best_log10: Option<f64>,
}

impl<'a> Further<'a, '_> {
    /// Searches `choices` one after the other, after `search`, until one shows it.
    fn search(
        &self,
        mut search: TriangleSearch<'a>,
        choices: impl Iterator<Item = FurtherSearch<'a>>,
    ) -> (TriangleSearch<'a>, FoundFurther) {
        let mut of_all = FoundFurther {
            found: None,
            best_log10: search.best_log10_false_alarm(),
        };
        for choice in choices {
            let found;
            (search, found) = self.search_one(search, &choice);
            let log10 = search.best_log10_false_alarm();
            of_all.best_log10 = [of_all.best_log10, log10]
                .into_iter()
                .flatten()
                .reduce(f64::min);
            of_all.found = found;
            if found.is_some() || search.is_interrupted() {
                break;
            }
        }
        (search, of_all)
    }

    fn search_one(
        &self,
        search: TriangleSearch<'a>,
        choice: &FurtherSearch<'a>,
    ) -> (TriangleSearch<'a>, Option<FoundHypothesis>) {
        let Self { whole, priors } = *self;
        let Some(window) = choice.window else {
            let mut search = search.again(choice.problem, choice.plan, priors);
            let found = search.run();
            return (search, found);
        };
        let of_window = window.priors(priors, whole.field.width_px);
        let mut search = search.again(choice.problem, choice.plan, &of_window);
        match search.run() {
            Some(found) => search.follow(window, &found, whole, priors),
            None => (search, None),
        }
    }
}

/// A field whose pointing is found, and whose stars have no names yet.
pub struct PointedField<'w, 'a> {
    /// The largest probability of a name that it is chance.
    most_chance: f64,
    problem: Problem<'a>,
    search: TriangleSearch<'a>,
    found: FoundHypothesis,
    /// What to say where the stars do not confirm the pointing after all.
    failure: SearchFailure,
    bright: &'w mut Brightest,
    answer: &'w mut Option<Identification>,
}

impl<'w> PointedField<'w, '_> {
    /// Names every star that can be named with the odds of the workspace, and fits attitude and
    /// optics to all of these.
    ///
    /// # Errors
    /// The [`SearchFailure`] where too few stars have a sure name.
    pub fn name_stars(self) -> Result<&'w Identification, SearchFailure> {
        let Self {
            most_chance,
            problem,
            mut search,
            found,
            failure,
            answer,
            ..
        } = self;
        let start = search.with_more_stars(&found);
        let named = with_names(problem, &mut search, &start, most_chance);
        let (refined, log10) = named.ok_or(failure)?;
        let pairs = &search.refiner().pairs;
        let posed = Posed::new(
            problem,
            refined.hypothesis(),
            refined.excess_sigma_px,
            pairs,
        );
        let conspicuous = posed.pairs(most_chance);
        let pairs = &mut search.refiner().pairs;
        if !conspicuous.is_empty() {
            pairs.extend(conspicuous);
            pairs.sort_unstable_by_key(|pair| pair.observed);
        }
        Ok(answered(answer, &refined, log10, problem.field, pairs))
    }

    /// Attitude and optics from the brightest stars alone: those that the pointing was found with.
    /// They are named and fitted as [`name_stars`](Self::name_stars) does it with all. So few stars
    /// cannot show that a lens is ideal, so its first term is always fitted: the stated errors are
    /// larger, and hold for real lenses.
    ///
    /// # Errors
    /// The [`SearchFailure`] where too few stars have a sure name.
    pub fn attitude(self) -> Result<&'w Identification, SearchFailure> {
        self.attitude_mut().map(|found| &*found)
    }

    fn attitude_mut(self) -> Result<&'w mut Identification, SearchFailure> {
        let Self {
            most_chance,
            problem: whole,
            mut search,
            found,
            failure,
            bright,
            answer,
            ..
        } = self;
        let searched = search.problem();
        let problem = Problem {
            field: bright.select(searched.field, ATTITUDE_STARS.max(found.stars)),
            ..searched
        };
        let of_few = NamingStart {
            most_chance,
            by_place: false,
            min_distortion: Some(DistortionModel::Radial),
        };
        let refiner = search.refiner();
        let refined = refiner.with_names(problem, &found.refined, &of_few);
        let refined = refined.filter(|_| refiner.pairs.len() >= MIN_STARS);
        let refined = refined.ok_or(failure)?;
        let log10_unseen = search.log10_unseen(whole.field, &refined.hypothesis());
        let log10 = found.log10_false_alarm - log10_unseen;
        if log10 > LOG10_FALSE_ALARM_LIMIT {
            return Err(failure);
        }
        let pairs = &search.refiner().pairs;
        Ok(answered(answer, &refined, log10, problem.field, pairs))
    }
}

/// The brightest stars of a field, as a field. Its buffer is reused.
#[derive(Debug, Default)]
struct Brightest(Option<StarField>);

impl Brightest {
    fn select(&mut self, field: &StarField, count: usize) -> &StarField {
        let mut stars = self.0.take().map_or_else(Vec::new, |old| old.stars);
        stars.clear();
        stars.extend_from_slice(field.brightest(count));
        self.0.insert(field.with_stars(stars))
    }
}

/// Puts the fit into `answer`, whose buffer is reused.
fn answered<'a>(
    answer: &'a mut Option<Identification>,
    refined: &Refined,
    log10: f64,
    field: &StarField,
    pairs: &[Pair],
) -> &'a mut Identification {
    let mut matches = answer.take().map_or_else(Vec::new, |old| old.matches);
    matches.clear();
    matches.extend(pairs.iter().map(|pair| star_match(pair, field)));
    answer.insert(identification(refined, log10, matches, field.places))
}

/// The final fit, to all stars with a sure name, with as much distortion as they support; the
/// search's buffers hold these names. `None` where there are too few names.
///
/// It begins with the brightest stars. If hardly any of them get a name, it begins again with fewer
/// of them, and at last with the search's own answer; the fit with most names counts.
fn with_names(
    problem: Problem,
    search: &mut TriangleSearch,
    found: &Refined,
    most_chance: f64,
) -> Option<(Refined, f64)> {
    let mut best: Option<NamedFit> = None;
    for start in CALIBRATION_STARS.map(Some).into_iter().chain([None]) {
        let settled = match start {
            Some(stars) => settle(problem, search, found, stars),
            None => Some(*found),
        };
        let named = settled.and_then(|settled| name(problem, search, &settled, most_chance));
        let Some(named) = named else {
            continue;
        };
        let began_with = start.map_or(0, |stars| stars.min(problem.field.stars.len()));
        let is_good = named.names as f64 >= GOOD_FRACTION * began_with as f64;
        if best.as_ref().is_none_or(|best| named.names > best.names) {
            search.keep_pairs();
            best = Some(named);
        }
        if is_good {
            break;
        }
    }
    let best = named_outwards(problem, search, best?, most_chance);
    search.restore_pairs();
    Some((best.refined, best.log10))
}

/// The fit of a lens that images more of the frame than the named stars are in, as long as it names
/// more; the search keeps these names.
fn named_outwards(
    problem: Problem,
    search: &mut TriangleSearch,
    mut best: NamedFit,
    most_chance: f64,
) -> NamedFit {
    /// Largest distance of true pairs, in diagonals of the frame.
    const RADIUS_FRACTION: f64 = 0.002;
    const MAX_ROUNDS: usize = 3;
    let field = problem.field;
    for _ in 0..MAX_ROUNDS {
        search.restore_pairs();
        let followed = search.followed_outwards(problem, &best.refined);
        let settled = followed.and_then(|hypothesis| {
            let start = Start {
                hypothesis: &hypothesis,
                radius_px: RADIUS_FRACTION * libm::hypot(field.width_px, field.height_px),
                sceptical: false,
                stars: hypothesis.fitted_stars,
                richest: DistortionModel::Irregular5,
            };
            search.refiner().refine(problem, &start)
        });
        let named = settled.and_then(|settled| name(problem, search, &settled, most_chance));
        match named {
            Some(named) if named.names > best.names => {
                search.keep_pairs();
                best = named;
            }
            _ => break,
        }
    }
    best
}

/// A fit to the stars with sure names.
struct NamedFit {
    refined: Refined,
    log10: f64,
    names: usize,
}

/// Fits as much distortion as the `stars` brightest stars support.
fn settle(
    problem: Problem,
    search: &mut TriangleSearch,
    found: &Refined,
    stars: usize,
) -> Option<Refined> {
    let field = problem.field;
    let diagonal_px = libm::hypot(field.width_px, field.height_px);
    let area_px2 = field.width_px * field.height_px;
    let by_chance_px = (CHANCE_PAIRS * area_px2 / (PI * stars as f64)).sqrt();
    let hypothesis = found.hypothesis();
    let start = Start {
        hypothesis: &hypothesis,
        radius_px: by_chance_px.clamp(
            FINAL_RADIUS_FRACTION * diagonal_px,
            MAX_RADIUS_FRACTION * diagonal_px,
        ),
        sceptical: false,
        stars,
        richest: DistortionModel::Irregular5,
    };
    search.refiner().refine(problem, &start)
}

/// Names all stars, from `settled` on; `None` where too few have a sure name.
fn name(
    problem: Problem,
    search: &mut TriangleSearch,
    settled: &Refined,
    most_chance: f64,
) -> Option<NamedFit> {
    let refiner = search.refiner();
    let of_all = NamingStart {
        most_chance,
        by_place: true,
        min_distortion: None,
    };
    let refined = refiner.with_names(problem, settled, &of_all)?;
    let names = refiner.pairs.len();
    let log10 = search.log10_of_answer(problem.field, &refined.hypothesis())?;
    let is_sure = names >= MIN_STARS && log10 <= LOG10_FALSE_ALARM_LIMIT;
    is_sure.then_some(NamedFit {
        refined,
        log10,
        names,
    })
}

fn star_match(pair: &Pair, field: &StarField) -> StarMatch {
    StarMatch {
        source: field.stars[pair.observed].source,
        star: pair.star,
        light: pair.direction,
        residual_px: pair.residual_px,
        p_chance: pair.p_chance,
    }
}

/// The camera, without the part of the frame where a lens that does not image all of it has shown no stars.
fn known_part(
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
    matches: &[StarMatch],
) -> CameraModel {
    /// Frames whose corners are nearer to the axis than this see the sky all over.
    const WIDE_RAD: f64 = 60.0 * RAD_PER_DEG;
    /// Stars may be this much farther from the axis than the outermost that is named.
    const MARGIN_RAD: f64 = RAD_PER_DEG;
    let corners_rad = camera.radius_rad();
    if (camera.is_pinhole() && camera.fills_frame()) || corners_rad < WIDE_RAD {
        return *camera;
    }
    let angle_rad = |star: &StarMatch| {
        let direction = icrs_to_camera.apply(&star.light);
        direction.angle_to(&UnitVector::BORESIGHT)
    };
    let outermost_rad = matches.iter().map(angle_rad).fold(0.0, f64::max);
    camera.limited_to(corners_rad.min(outermost_rad + MARGIN_RAD))
}

fn identification(
    refined: &Refined,
    log10_false_alarm: f64,
    matches: Vec<StarMatch>,
    places: StarPlaces,
) -> Identification {
    let fit = &refined.fit;
    let covariance = &fit.covariance;
    let sum_sq: f64 = matches.iter().map(|m| m.residual_px.powi(2)).sum();
    Identification {
        attitude_covariance_rad2: covariance.fixed_view::<3, 3>(0, 0).into_owned(),
        focal_length_sigma_px: covariance[(3, 3)].sqrt() * fit.camera.central_focal_length_px(),
        centre_sigma_px: [0.0; 2],
        camera: known_part(&fit.camera, &fit.icrs_to_camera, &matches),
        icrs_to_camera: fit.icrs_to_camera,
        places,
        lens_is_known: false,
        excess_sigma_px: refined.excess_sigma_px,
        rms_px: (sum_sq / matches.len().max(1) as f64).sqrt(),
        matches,
        log10_false_alarm,
    }
}
