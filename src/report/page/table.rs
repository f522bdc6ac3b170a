//! Tables of a page.

use serde::{Serialize, Serializer};
use std::collections::HashMap;

/// Whole numbers up to this are the same in scripts.
const LARGEST_EXACT: f64 = 9_007_199_254_740_992.0;

/// A table that sorts and filters.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PageTable {
    title: String,
    rows: usize,
    columns: Vec<PageColumn>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct PageColumn {
    name: String,
    #[serde(flatten)]
    cells: ColumnCells,
}

/// The cells of a column.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
enum ColumnCells {
    Numbers(Vec<Option<Number>>),
    Texts(Texts),
}

/// Texts, each of them once, and for each row which one it has.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Texts {
    all: Vec<String>,
    which: Vec<usize>,
}

/// A number, written without a fraction where it is whole.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Number(f64);

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.0.fract() == 0.0 {
            serializer.serialize_i64(self.0 as i64)
        } else {
            serializer.serialize_f64(self.0)
        }
    }
}

impl PageTable {
    /// The table of a CSV text with a heading. A column of numbers and empty cells is one of numbers; empty
    /// columns are left out.
    ///
    /// # Errors
    /// [`csv::Error`] if the rows differ in length.
    pub fn from_csv(title: &str, csv: &str) -> Result<Self, csv::Error> {
        let mut reader = csv::Reader::from_reader(csv.as_bytes());
        let names = reader.headers()?.clone();
        let rows = reader.records().collect::<Result<Vec<_>, _>>()?;
        let column = |(place, name): (usize, &str)| {
            let cells: Vec<&str> = rows.iter().map(|row| &row[place]).collect();
            let is_empty = cells.iter().all(|cell| cell.is_empty());
            (!is_empty).then(|| PageColumn {
                name: name.to_owned(),
                cells: ColumnCells::of(&cells),
            })
        };
        Ok(Self {
            title: title.to_owned(),
            rows: rows.len(),
            columns: names.iter().enumerate().filter_map(column).collect(),
        })
    }

    pub(super) fn title(&self) -> String {
        self.title.clone()
    }
}

impl ColumnCells {
    fn of(cells: &[&str]) -> Self {
        let number = |cell: &&str| match *cell {
            "" => Some(None),
            text => number_of(text).map(|number| Some(Number(number))),
        };
        let numbers: Option<Vec<_>> = cells.iter().map(number).collect();
        numbers.map_or_else(|| Self::Texts(Texts::from_cells(cells)), Self::Numbers)
    }
}

fn number_of(text: &str) -> Option<f64> {
    let number: f64 = text.parse().ok()?;
    (number.is_finite() && number.abs() <= LARGEST_EXACT).then_some(number)
}

impl Texts {
    fn from_cells(cells: &[&str]) -> Self {
        let mut all = Vec::new();
        let mut places = HashMap::new();
        let which = cells.iter().map(|cell| {
            *places.entry(*cell).or_insert_with(|| {
                all.push((*cell).to_owned());
                all.len() - 1
            })
        });
        let which = which.collect();
        Self { all, which }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_numbers_or_texts_and_empty_ones_are_left_out() {
        let csv = "frame,n,mag,none,seed\na,3,,,18446744073709551615\nb,4,12.50,,1\na,,0.25,,2\n";
        let table = PageTable::from_csv("Frames", csv).unwrap();
        let json = serde_json::to_string(&table).unwrap();
        assert_eq!(
            json,
            "{\"title\":\"Frames\",\"rows\":3,\"columns\":[\
             {\"name\":\"frame\",\"texts\":{\"all\":[\"a\",\"b\"],\"which\":[0,1,0]}},\
             {\"name\":\"n\",\"numbers\":[3,4,null]},\
             {\"name\":\"mag\",\"numbers\":[null,12.5,0.25]},\
             {\"name\":\"seed\",\"texts\":{\"all\":[\"18446744073709551615\",\"1\",\"2\"],\"which\":[0,1,2]}}]}"
        );
    }
}
