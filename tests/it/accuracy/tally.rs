//! Sums of errors and of their stated values.

/// Root mean squares, with their standard errors for Gaussian errors.
#[derive(Debug, Clone, Copy, Default)]
pub struct Rms {
    count: f64,
    sum_sq: f64,
}

impl Rms {
    pub fn add(&mut self, value: f64) {
        self.count += 1.0;
        self.sum_sq += value * value;
    }

    pub fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.sum_sq += other.sum_sq;
    }

    pub fn count(&self) -> f64 {
        self.count
    }

    pub fn value(&self) -> f64 {
        (self.sum_sq / self.count).sqrt()
    }

    /// Standard error over value.
    pub fn relative_error(&self) -> f64 {
        1.0 / (2.0 * self.count).sqrt()
    }
}

/// Mean, standard deviation and extremes.
#[derive(Debug, Clone, Copy, Default)]
pub struct Spread {
    pub count: f64,
    sum: f64,
    sum_sq: f64,
}

impl Spread {
    pub fn add(&mut self, value: f64) {
        self.count += 1.0;
        self.sum += value;
        self.sum_sq += value * value;
    }

    pub fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.sum_sq += other.sum_sq;
    }

    pub fn mean(&self) -> f64 {
        self.sum / self.count
    }

    pub fn sigma(&self) -> f64 {
        (self.sum_sq / self.count - self.mean().powi(2)).sqrt()
    }

    /// The standard error of the mean.
    pub fn mean_error(&self) -> f64 {
        self.sigma() / self.count.sqrt()
    }

    /// The standard error of the standard deviation of Gaussian values.
    pub fn sigma_error(&self) -> f64 {
        self.sigma() / (2.0 * self.count).sqrt()
    }
}
