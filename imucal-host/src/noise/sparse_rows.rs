//! A matrix of which each row has a few entries that are not zero.

/// Rows with the columns and values of their entries.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SparseRows {
    /// Where each row's entries end.
    ends: Vec<usize>,
    entries: Vec<(usize, f64)>,
}

impl SparseRows {
    /// So many rows without an entry.
    pub fn empty(rows: usize) -> Self {
        Self { ends: vec![0; rows], entries: Vec::new() }
    }

    /// No row yet, with memory for so many rows and entries: rows that grow as they come may take twice as much.
    pub fn with_capacity(rows: usize, entries: usize) -> Self {
        Self { ends: Vec::with_capacity(rows), entries: Vec::with_capacity(entries) }
    }

    /// Gives back the memory that its rows do not need.
    #[must_use]
    pub fn shrunk(mut self) -> Self {
        self.ends.shrink_to_fit();
        self.entries.shrink_to_fit();
        self
    }

    /// Appends a row; its columns differ from one another.
    pub fn push(&mut self, row: impl IntoIterator<Item = (usize, f64)>) {
        self.entries.extend(row);
        self.ends.push(self.entries.len());
    }

    /// Columns and values of a row's entries.
    pub fn row(&self, row: usize) -> &[(usize, f64)] {
        let from = row.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.entries[from..self.ends[row]]
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.ends.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_row_has_its_own_entries() {
        let mut rows = SparseRows::empty(1);
        rows.push([(2, 0.5), (0, 1.0)]);
        rows.push([]);
        rows.push([(1, -3.0)]);
        assert_eq!(rows.rows(), 4);
        let found: Vec<&[(usize, f64)]> = (0..4).map(|row| rows.row(row)).collect();
        assert_eq!(found, [&[][..], &[(2, 0.5), (0, 1.0)], &[], &[(1, -3.0)]]);
    }
}
