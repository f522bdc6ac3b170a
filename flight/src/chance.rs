//! How probable is it that chance does as well?

use core::f64::consts::LN_10;

/// log10 of the probability that of `tries` with the probability `p` at least `hits` are hits.
pub(crate) fn log10_tail(tries: usize, hits: usize, p: f64) -> f64 {
    if hits == 0 || p >= 1.0 {
        return 0.0;
    }
    if hits > tries || p <= 0.0 {
        return f64::NEG_INFINITY;
    }
    let (n, k) = (tries as f64, hits as f64);
    let ln_choose = libm::lgamma(n + 1.0) - libm::lgamma(k + 1.0) - libm::lgamma(n - k + 1.0);
    let first = ln_choose + k * libm::log(p) + (n - k) * libm::log1p(-p);
    // The terms after the first one, relative to it.
    let (mut sum, mut term) = (1.0, 1.0);
    for hit in hits..tries {
        let hit = hit as f64;
        term *= (n - hit) / (hit + 1.0) * p / (1.0 - p);
        sum += term;
        if term < 1e-12 * sum {
            break;
        }
    }
    ((first + libm::log(sum)) / LN_10).min(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_those_of_the_binomial_distribution() {
        // 1 − 0.9¹⁰, and 0.1¹⁰.
        assert!((log10_tail(10, 1, 0.1) - (1.0 - 0.9_f64.powi(10)).log10()).abs() < 1e-12);
        assert!((log10_tail(10, 10, 0.1) + 10.0).abs() < 1e-12);
        assert_eq!(log10_tail(10, 0, 0.1), 0.0);
        assert_eq!(log10_tail(3, 4, 0.1), f64::NEG_INFINITY);
        assert!(log10_tail(200, 30, 0.9).abs() < 1e-9);
    }
}
