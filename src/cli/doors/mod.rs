//! Command lines and protocols of other solvers, answered by the pipeline: what they ask → [`Question`] →
//! solutions → their files and lines.

#![allow(dead_code)] // until a door uses it

#[cfg(feature = "serve")]
pub(super) mod serve;

use super::exit::CommandError;
use super::options::catalog::CatalogOptions;
use super::solving::{InputSolver, Inputs, Sink, SolvingPlan};
use starpipe::catalog::Catalog;
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

    /// Solves `paths`, and hands what the sink makes of the images of each to `take`, in their order. If `take`
    /// breaks, the remaining ones are skipped.
    pub(super) fn answer<S: Sink>(
        &self,
        catalog: &CatalogOptions,
        paths: &[impl AsRef<Path> + Sync],
        sink: impl FnOnce(&Catalog) -> S,
        take: impl FnMut(Vec<(String, anyhow::Result<S::Made>)>) -> ControlFlow<()>,
    ) -> Result<(), CommandError> {
        catalog.with_deep(false, |pool, indexed, deep| {
            let solver = InputSolver {
                pool,
                inputs: &self.inputs,
                context: self.context(indexed, deep),
                memory: self.plan.memory,
                sink: sink(indexed.catalog()),
            };
            solver.solve_all(paths, take);
            Ok(())
        })
    }
}
