//! Aligned tables for people.

/// Lines of a table. Columns of numbers are aligned to the right, all others to the left.
pub fn table(header: &[&str], rows: &[Vec<String>]) -> String {
    let header: Vec<String> = header.iter().map(|name| name.to_string()).collect();
    let columns: Vec<Column> = (0..header.len()).map(|k| Column::new(&header[k], rows.iter().map(|r| &r[k]))).collect();
    let line = |row: &Vec<String>| {
        let cells: Vec<String> = row.iter().zip(&columns).map(|(cell, column)| column.pad(cell)).collect();
        cells.join("  ").trim_end().to_owned()
    };
    [&header].into_iter().chain(rows).map(line).collect::<Vec<_>>().join("\n")
}

struct Column {
    width: usize,
    numeric: bool,
}

impl Column {
    fn new<'a>(name: &str, cells: impl Iterator<Item = &'a String> + Clone) -> Column {
        let numeric = cells.clone().all(|cell| cell == "-" || cell.starts_with(|c: char| c.is_ascii_digit()));
        let width = cells.map(|cell| cell.chars().count()).max().unwrap_or(0).max(name.chars().count());
        Column { width, numeric }
    }

    fn pad(&self, cell: &str) -> String {
        let width = self.width;
        if self.numeric { format!("{cell:>width$}") } else { format!("{cell:<width$}") }
    }
}

#[cfg(test)]
mod tests {
    use super::table;

    #[test]
    fn numbers_stand_right_and_words_left() {
        let rows = [vec!["place".to_owned(), "8".to_owned()], vec!["x".to_owned(), "1200".to_owned()]];
        assert_eq!(table(&["array", "bytes"], &rows), "array  bytes\nplace      8\nx       1200");
    }
}
