//! Command lines and protocols of other solvers, answered by the pipeline: what they ask → [`Question`] →
//! solutions → their files and lines.

pub(super) mod astap;
pub(super) mod solve_field;

#[cfg(feature = "serve")]
pub(super) mod serve;

use super::exit::CommandError;
use super::options::catalog::CatalogOptions;
use super::solving::{InputSolver, Inputs, Sink, SolvedImage, SolvingPlan};
use starpipe::catalog::Catalog;
use starpipe::frame::ImageName;
use starpipe::identify::{IndexedCatalog, ScalePrior};
use starpipe::solve::{Context, DeepSky};
use std::ops::ControlFlow;
use std::path::Path;

/// What another program asks. Its hints may be wrong: they are tried first.
pub(super) struct Question {
    pub(super) inputs: Inputs,
    pub(super) plan: SolvingPlan,
    /// The scale, in place of that of the plan.
    pub(super) scale: Option<ScalePrior>,
}

impl Question {
    /// What the stages need to answer it.
    pub(super) fn context<'a>(
        &'a self,
        indexed: &'a IndexedCatalog<'a>,
        deep: Option<&'a DeepSky>,
    ) -> Context<'a> {
        let mut context = self.plan.context(indexed);
        context.deep = deep;
        let stated = self.scale.or(context.priors.scale);
        context.priors.scale = stated.map(ScalePrior::tried_first);
        context
    }

    /// Solves `paths`, and hands what `make` makes of the images of each to `take`, in their order. If `take`
    /// breaks, the remaining ones are skipped.
    pub(super) fn answer<M: Send>(
        &self,
        catalog: &CatalogOptions,
        paths: &[impl AsRef<Path> + Sync],
        make: impl Fn(&ImageName, &SolvedImage, &Catalog) -> M + Sync,
        take: impl FnMut(Vec<(String, anyhow::Result<M>)>) -> ControlFlow<()>,
    ) -> Result<(), CommandError> {
        catalog.with_deep(false, |pool, indexed, deep| {
            let solver = InputSolver {
                pool,
                inputs: &self.inputs,
                context: self.context(indexed, deep),
                memory: self.plan.memory,
                sink: Make {
                    make,
                    catalog: indexed.catalog(),
                },
            };
            solver.solve_all(paths, take);
            Ok(())
        })
    }
}

/// Makes something of an image and the catalog that it was solved with.
struct Make<'a, F> {
    make: F,
    catalog: &'a Catalog,
}

impl<M: Send, F: Fn(&ImageName, &SolvedImage, &Catalog) -> M + Sync> Sink for Make<'_, F> {
    type Made = M;

    fn make(&self, image: &ImageName, solved: &SolvedImage) -> M {
        (self.make)(image, solved, self.catalog)
    }
}
