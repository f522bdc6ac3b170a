//! Tables of the effective PSF over the field of a frame.
//!
//! [`EffectivePsf`] → a [`PsfTable`] at each node of a grid over the field → that at a star's place,
//! mixed from the four nodes around it.

use super::effective::{EffectivePsf, FieldForm, LocalPsf};
use super::table::{ComponentExtent, PsfTable};
use super::taps::TableLayout;
use crate::base::size::Size;
use multiversion::multiversion;
use std::sync::OnceLock;

/// The tables of a PSF over the field of a frame, each computed when it is first needed.
#[derive(Debug)]
pub(crate) struct FieldTables<'a> {
    /// The PSF.
    pub psf: &'a EffectivePsf,
    /// `None` where the components are too sharp for a table: they are summed instead.
    layout: Option<TableLayout>,
    /// Distance of the nodes along x and y, in pixels.
    cell_px: [f64; 2],
    /// Cells along x and y: one fewer than nodes.
    cells: [usize; 2],
    /// Row by row; empty where there are fewer stars, each of which has a table of its own.
    nodes: Vec<OnceLock<PsfTable>>,
}

impl<'a> FieldTables<'a> {
    /// For so many stars in a frame of this size.
    pub fn new(psf: &'a EffectivePsf, size: Size, stars: usize) -> Self {
        let diagonal_px = size.diagonal_px();
        let along = cells_along_diagonal(psf) as f64;
        let cells = size
            .sides()
            .map(|side| (along * side as f64 / diagonal_px).ceil() as usize);
        let spacing = |side: usize, cells: usize| (side - 1) as f64 / cells.max(1) as f64;
        let mut tables = Self {
            psf,
            layout: None,
            cell_px: [
                spacing(size.width, cells[0]),
                spacing(size.height, cells[1]),
            ],
            cells,
            nodes: Vec::new(),
        };
        let count = (cells[0] + 1) * (cells[1] + 1);
        if count <= stars {
            tables.nodes.resize_with(count, OnceLock::new);
        }
        tables.layout = tables.common_layout();
        tables
    }

    /// Half of the side of the window of a spot of this size, in pixels.
    pub fn window_radius(&self, spot_px: f64) -> usize {
        self.psf.window_radius(spot_px)
    }

    /// The spot at a pixel: its table, or its components.
    pub fn at(&self, x_px: f64, y_px: f64, local: &mut LocalPsf) {
        let Some(layout) = self.layout else {
            self.psf.at(x_px, y_px, local);
            local.table.clear();
            return;
        };
        if self.nodes.is_empty() {
            self.psf.at(x_px, y_px, local);
            local.table.fill(&local.components, layout);
            return;
        }
        local.components.clear();
        local.spot_px = self.psf.spot_px;
        let table = &mut local.table;
        table.layout = layout;
        let [(column, right), (row, below)] = [(0, x_px), (1, y_px)].map(|(axis, at_px)| {
            let cells = self.cells[axis];
            if cells == 0 {
                return (0, 0.0);
            }
            let place = (at_px / self.cell_px[axis]).clamp(0.0, cells as f64);
            let cell = (place as usize).min(cells - 1);
            (cell, place - cell as f64)
        });
        let columns = [(column, 1.0 - right), (column + 1, right)];
        let rows = [(row, 1.0 - below), (row + 1, below)];
        let parts = rows.map(|(row, of_row)| {
            columns.map(|(column, of_column)| {
                let part = of_row * of_column;
                // Beyond the last node there is none, and no part of it.
                let node = if part > 0.0 {
                    [column, row]
                } else {
                    [columns[0].0, rows[0].0]
                };
                (&self.node(node, layout).coefficients[..], part as f32)
            })
        });
        let [[a, b], [c, d]] = parts;
        table.coefficients.resize(layout.len(), 0.0);
        if a.1 == 1.0 {
            table.coefficients.copy_from_slice(a.0);
        } else {
            mix([a, b, c, d], &mut table.coefficients);
        }
    }

    /// The table at a node.
    fn node(&self, [column, row]: [usize; 2], layout: TableLayout) -> &PsfTable {
        self.nodes[row * (self.cells[0] + 1) + column].get_or_init(|| {
            let mut local = LocalPsf::default();
            self.components_at([column, row], &mut local);
            let mut table = PsfTable::default();
            table.fill(&local.components, layout);
            table
        })
    }

    /// The components at a node.
    fn components_at(&self, node: [usize; 2], local: &mut LocalPsf) {
        let [x, y] = [0, 1].map(|axis| node[axis] as f64 * self.cell_px[axis]);
        self.psf.at(x, y, local);
    }

    /// The layout that suits the spots at all nodes; `None` where they are too sharp for a table.
    fn common_layout(&self) -> Option<TableLayout> {
        let mut local = LocalPsf::default();
        let mut extent = ComponentExtent::default();
        for row in 0..self.cells[1] + 1 {
            for column in 0..self.cells[0] + 1 {
                self.components_at([column, row], &mut local);
                extent.add(&local.components);
            }
        }
        extent.layout()
    }
}

/// Cells along the diagonal of a frame: so many that the PSF is linear in each.
fn cells_along_diagonal(psf: &EffectivePsf) -> usize {
    /// Largest change of a moment over a cell: that of the light differs from a linear one by a
    /// part of an eighth of its square, as little as the interpolation in a table.
    const MAX_CHANGE: f64 = 0.12;
    /// The moments change this much faster at the corners than on average from the centre.
    const FASTEST: f64 = 2.0;
    const MAX_CELLS: f64 = 32.0;
    /// Where spots point outward, they turn by a quarter of a right angle in the cells that are a
    /// sixth of the way to the corner.
    const CELLS_OF_RADIAL: f64 = MAX_CELLS;
    let ranges = psf.moments.range.map(|[least, most]| most - least);
    let range = ranges.into_iter().fold(0.0, f64::max);
    let of_moments = (2.0 * FASTEST * range / MAX_CHANGE).ceil();
    let of_form = match psf.form {
        FieldForm::Symmetric | FieldForm::Fixed => 0.0,
        FieldForm::Radial => CELLS_OF_RADIAL,
    };
    of_moments.max(of_form).min(MAX_CELLS) as usize
}

/// The sum of parts of four tables.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn mix(parts: [(&[f32], f32); 4], into: &mut [f32]) {
    let [(a, of_a), (b, of_b), (c, of_c), (d, of_d)] = parts;
    let tables = a.iter().zip(b).zip(c.iter().zip(d));
    for (into, ((a, b), (c, d))) in into.iter_mut().zip(tables) {
        *into = (of_a * a + of_b * b) + (of_c * c + of_d * d);
    }
}

#[cfg(test)]
mod tests {
    use super::super::table::tests::components;
    use super::*;
    use crate::detect::psf::{FieldComponent, FieldFrame, FieldMoments, GaussianComponent};

    #[test]
    fn tables_between_nodes_agree_with_the_spot_there() {
        let size = Size::new(1200, 900);
        let mut moments = FieldMoments::constant(FieldFrame::new(size), [0.0; 3]);
        // Twice as wide in the corners, and elongated.
        moments.coefficients[0][3] = 0.69;
        moments.coefficients[0][5] = 0.69;
        moments.coefficients[1][3] = 0.4;
        moments.range = [[0.0, 0.69], [0.0, 0.4], [0.0, 0.0]];
        let component = |component: GaussianComponent| FieldComponent {
            component,
            corner_share: component.share,
        };
        let psf = EffectivePsf {
            components: components(0.6).into_iter().map(component).collect(),
            form: FieldForm::Fixed,
            typical: [0.0; 3],
            moments,
            spot_px: 1.0,
            radius_px: 6,
        };
        let tables = FieldTables::new(&psf, size, 10_000);
        let alone = FieldTables::new(&psf, size, 1);
        let [mut mixed, mut exact] = [LocalPsf::default(), LocalPsf::default()];
        for [x, y] in [[600.0, 450.0], [1180.0, 20.0], [333.0, 777.0], [0.0, 0.0]] {
            tables.at(x, y, &mut mixed);
            alone.at(x, y, &mut exact);
            let [mixed, exact] = [&mixed, &exact].map(|local| &local.table.coefficients);
            let brightest = exact.iter().copied().fold(0.0, f32::max);
            for (a, b) in mixed.iter().zip(exact) {
                assert!((a - b).abs() < 1e-2 * brightest, "{x} {y}: {a} {b}");
            }
        }
    }
}
