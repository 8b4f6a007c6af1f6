//! A matrix of which each row has a few entries that are not zero.

/// Rows with the columns and values of their entries; columns in half a word each, since rows are many.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SparseRows {
    /// Where each row's entries end.
    ends: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl SparseRows {
    /// So many rows without an entry.
    pub fn empty(rows: usize) -> Self {
        Self { ends: vec![0; rows], ..Self::default() }
    }

    /// No row yet, with memory for so many rows and entries: rows that grow as they come may take twice as much.
    pub fn with_capacity(rows: usize, entries: usize) -> Self {
        Self {
            ends: Vec::with_capacity(rows),
            columns: Vec::with_capacity(entries),
            values: Vec::with_capacity(entries),
        }
    }

    /// Gives back the memory that its rows do not need.
    #[must_use]
    pub fn shrunk(mut self) -> Self {
        self.ends.shrink_to_fit();
        self.columns.shrink_to_fit();
        self.values.shrink_to_fit();
        self
    }

    /// Appends a row; its columns differ from one another. There are fewer than 2³² columns.
    pub fn push(&mut self, row: impl IntoIterator<Item = (usize, f64)>) {
        for (column, value) in row {
            self.columns.push(column as u32);
            self.values.push(value);
        }
        self.ends.push(self.values.len());
    }

    /// Columns and values of a row's entries.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + Clone {
        let from = row.checked_sub(1).map_or(0, |before| self.ends[before]);
        let entries = from..self.ends[row];
        let columns = self.columns[entries.clone()].iter().map(|column| *column as usize);
        columns.zip(self.values[entries].iter().copied())
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
        let found: Vec<Vec<(usize, f64)>> = (0..4).map(|row| rows.row(row).collect()).collect();
        assert_eq!(found, [vec![], vec![(2, 0.5), (0, 1.0)], vec![], vec![(1, -3.0)]]);
    }
}
