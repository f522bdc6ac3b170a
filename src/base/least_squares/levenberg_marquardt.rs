//! Fits of any function, by the method of Levenberg and Marquardt.

/// The parameters near `start` for which the squares of `residuals` have the least sum.
///
/// `residuals` adds its numbers to an empty list, and says whether the parameters are possible. The
/// derivatives are taken over `steps`. `None` if there are fewer residuals than parameters. No function is
/// used whose bits differ between machines.
pub(crate) fn levenberg_marquardt(
    start: &[f64],
    steps: &[f64],
    residuals: impl Fn(&[f64], &mut Vec<f64>) -> bool,
) -> Option<Vec<f64>> {
    const MAX_STEPS: usize = 60;
    const CONVERGED: f64 = 1e-10;
    let cost_of = |parameters: &[f64]| {
        let mut found = Vec::new();
        let possible = residuals(parameters, &mut found);
        let cost: f64 = found.iter().map(|r| r * r).sum();
        (possible && cost.is_finite()).then_some((cost, found))
    };
    let mut parameters = start.to_vec();
    let (mut cost, mut found) = cost_of(&parameters)?;
    if found.len() < parameters.len() {
        return None;
    }
    let mut damping = 1e-9;
    for _ in 0..MAX_STEPS {
        let (matrix, slope) = normal_equations(&parameters, steps, &found, &residuals)?;
        let mut better = None;
        while better.is_none() && damping < 1e6 {
            if let Some(step) = solve(&matrix, &slope, damping) {
                let next: Vec<f64> = parameters.iter().zip(&step).map(|(p, s)| p - s).collect();
                better = cost_of(&next)
                    .filter(|(next_cost, _)| *next_cost < cost)
                    .map(|(next_cost, found)| (next, next_cost, found));
            }
            damping *= if better.is_some() { 0.1 } else { 10.0 };
        }
        damping = damping.max(1e-15);
        let Some((next, next_cost, next_found)) = better else {
            break;
        };
        let gained = cost - next_cost;
        (parameters, cost, found) = (next, next_cost, next_found);
        if gained <= CONVERGED * cost {
            break;
        }
    }
    Some(parameters)
}

/// The matrix and the right side of the equations of a step.
fn normal_equations(
    parameters: &[f64],
    steps: &[f64],
    found: &[f64],
    residuals: &impl Fn(&[f64], &mut Vec<f64>) -> bool,
) -> Option<(Vec<Vec<f64>>, Vec<f64>)> {
    let there = |index: usize, by: f64| {
        let mut moved = parameters.to_vec();
        moved[index] += by;
        let mut residual = Vec::with_capacity(found.len());
        residuals(&moved, &mut residual).then_some(residual)
    };
    let mut columns = Vec::with_capacity(steps.len());
    for (index, step) in steps.iter().enumerate() {
        let (low, high) = (there(index, -step)?, there(index, *step)?);
        let column = low.iter().zip(&high).map(|(l, h)| (h - l) / (2.0 * step));
        columns.push(column.collect::<Vec<f64>>());
    }
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let row = |a: &Vec<f64>| columns.iter().map(|b| product(a, b)).collect();
    let matrix = columns.iter().map(row).collect();
    let slope = columns.iter().map(|a| product(a, found)).collect();
    Some((matrix, slope))
}

/// Solves `matrix` · x = `right` by Cholesky's method, with `damping` added to the diagonal after all
/// columns have been given the length 1.
fn solve(matrix: &[Vec<f64>], right: &[f64], damping: f64) -> Option<Vec<f64>> {
    let size = right.len();
    let length = |i: usize| matrix[i][i].sqrt().max(f64::MIN_POSITIVE);
    let lengths: Vec<f64> = (0..size).map(length).collect();
    let mut factor = vec![vec![0.0; size]; size];
    let mut solved = vec![0.0; size];
    for i in 0..size {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
            let scaled = matrix[i][j] / (lengths[i] * lengths[j]);
            if i == j {
                let left = scaled + damping - known;
                if left.is_nan() || left <= 0.0 {
                    return None;
                }
                factor[i][i] = left.sqrt();
            } else {
                factor[i][j] = (scaled - known) / factor[j][j];
            }
        }
        let known: f64 = (0..i).map(|k| factor[i][k] * solved[k]).sum();
        solved[i] = (right[i] / lengths[i] - known) / factor[i][i];
    }
    for i in (0..size).rev() {
        let known: f64 = (i + 1..size).map(|k| factor[k][i] * solved[k]).sum();
        solved[i] = (solved[i] - known) / factor[i][i];
    }
    Some(solved.iter().zip(&lengths).map(|(s, l)| s / l).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nearly_singular_problem_is_solved() {
        // The coefficients of a polynomial of the fifth order, from 30 of its values.
        let wanted = [1.0, -2.0, 0.5, 0.25, -0.125, 3.0];
        let value = |c: &[f64], x: f64| c.iter().rev().fold(0.0, |sum, c| sum * x + c);
        let found = levenberg_marquardt(&[0.0; 6], &[1e-3; 6], |parameters, residuals| {
            residuals.extend((0..30).map(|i| {
                let x = f64::from(i) / 30.0;
                value(parameters, x) - value(&wanted, x)
            }));
            true
        });
        for (found, wanted) in found.unwrap().iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-6, "{found} {wanted}");
        }
    }
}
