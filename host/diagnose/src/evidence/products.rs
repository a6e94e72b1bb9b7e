//! Whitened columns and their inner products.

use rig_numerics::vector::dot;

/// Whitened columns of one joint and their inner products. The first is the torque.
pub(crate) struct Products {
    columns: Vec<Vec<f64>>,
    /// Lower triangle.
    gram: Vec<Vec<f64>>,
}

impl Products {
    /// Creates products of the torque alone.
    pub(crate) fn new(torque: Vec<f64>) -> Self {
        let mut own = Self {
            columns: Vec::new(),
            gram: Vec::new(),
        };
        own.push(torque);
        own
    }

    /// Adds a column and returns its number.
    pub(crate) fn push(&mut self, column: Vec<f64>) -> usize {
        self.gram.push(self.with_all(&column));
        self.columns.push(column);
        self.columns.len() - 1
    }

    /// Returns the inner products of a column with all columns, and with itself at the end.
    pub(crate) fn with_all(&self, column: &[f64]) -> Vec<f64> {
        (self.columns.iter().map(Vec::as_slice))
            .chain([column])
            .map(|other| dot(other, column))
            .collect()
    }

    /// Returns an inner product.
    pub(crate) fn of(&self, a: usize, b: usize) -> f64 {
        self.gram[a.max(b)][a.min(b)]
    }

    /// Returns the inner product with the torque.
    pub(crate) fn torque(&self, a: usize) -> f64 {
        self.gram[a][0]
    }

    /// Returns the number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.columns[0].len()
    }

    /// Returns a column.
    pub(crate) fn column(&self, a: usize) -> &[f64] {
        &self.columns[a]
    }
}
