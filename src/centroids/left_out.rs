//! Rows of a list of centroids that are not stars.

use crate::base::format::counted;
use std::fmt;

/// Why a row of a list cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum RowProblem {
    /// A number is missing, or is none.
    NoNumber,
    /// The flux is 0 or below.
    NoFlux,
    /// The standard error is 0 or below, or no number.
    NoError,
    /// It coincides with a brighter one.
    Coincident,
}

/// Rows of a list that are left out for one reason. `Display` gives the sentence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct LeftOut {
    /// The reason.
    pub problem: RowProblem,
    /// How many rows.
    pub count: usize,
    /// The first of them, from 1; 0 if unknown.
    pub first_row: u64,
}

impl LeftOut {
    pub(super) fn summarize(problems: &[(RowProblem, u64)]) -> Vec<Self> {
        let all = [
            RowProblem::NoNumber,
            RowProblem::NoFlux,
            RowProblem::NoError,
            RowProblem::Coincident,
        ];
        let of_problem = |problem| {
            let rows = problems.iter().filter(|(found, _)| *found == problem);
            Some(Self {
                problem,
                count: rows.clone().count(),
                first_row: rows.map(|(_, row)| *row).min()?,
            })
        };
        all.into_iter().filter_map(of_problem).collect()
    }
}

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verb = if self.count == 1 { "is" } else { "are" };
        let rows = counted(self.count, "row");
        write!(f, "{rows} of the list {verb} left out")?;
        match (self.first_row, self.count) {
            (0, _) => {}
            (row, 1) => write!(f, ", in line {row}")?,
            (row, _) => write!(f, ", the first in line {row}")?,
        }
        f.write_str(match self.problem {
            RowProblem::NoNumber => ": a number is missing",
            RowProblem::NoFlux => ": the flux is not above 0",
            RowProblem::NoError => ": the standard error is not above 0",
            RowProblem::Coincident if self.count == 1 => ": it is within 0.5 px of a brighter one",
            RowProblem::Coincident => ": they are within 0.5 px of a brighter one",
        })
    }
}
