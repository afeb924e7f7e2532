//! The text format: dimension, contacts, matrices, vectors. A matrix is full (0), of blocks (1), or what CSparse prints
//! (2, by columns or as triplets).

use crate::{
    error::{Error, Result},
    solve::{Matrix, Problem},
};
use std::str::FromStr;

pub fn parse(text: &str) -> Result<Problem> {
    let mut input = Input::new(text);
    let dims: usize = input.number("dimension")?;
    if ![2, 3].contains(&dims) {
        return input.bad(format!("dimension = {dims} must be 2 or 3"));
    }
    let n: usize = input.number("number of contacts")?;
    let first = matrix(&mut input)?;
    let Some(size) = n.checked_mul(dims) else { return input.bad(format!("{n} contacts are too many")) };
    // Nothing in the file names its form, but a second matrix begins with three integers of which two are known.
    let mut ahead = input.clone();
    let header: [Option<usize>; 3] = std::array::from_fn(|_| ahead.number("").ok());
    if header[1..] != [Some(first.rows), Some(size)] {
        let (q, mu) = (input.vector("q", size)?, input.vector("mu", n)?);
        return Problem::local(dims, &first, &q, &mu);
    }
    let h = matrix(&mut input)?;
    let (f, w, mu) = (input.vector("f", first.rows)?, input.vector("w", size)?, input.vector("mu", n)?);
    Problem::global(dims, &first, &h, &f, &w, &mu)
}

fn matrix(input: &mut Input) -> Result<Matrix> {
    let storage: usize = input.number("storage of a matrix")?;
    let (rows, columns) = (input.number("rows of a matrix")?, input.number("columns of a matrix")?);
    match storage {
        0 => full(input, rows, columns),
        1 => blocks(input, rows, columns),
        2 => csparse(input, rows, columns),
        other => input.bad(format!("storage {other} of a matrix must be 0 (full), 1 (blocks) or 2 (compressed)")),
    }
}

fn full(input: &mut Input, rows: usize, columns: usize) -> Result<Matrix> {
    let again = (input.number("rows of a full matrix")?, input.number("columns of a full matrix")?);
    let size = rows.checked_mul(columns).filter(|_| again == (rows, columns));
    let Some(size) = size else {
        return input.bad(format!("the full matrix is {} × {}, announced were {rows} × {columns}", again.0, again.1));
    };
    Ok(Matrix::dense(rows, columns, &input.vector("entries of a full matrix", size)?))
}

/// Rows of blocks; each block by columns, after its number.
fn blocks(input: &mut Input, rows: usize, columns: usize) -> Result<Matrix> {
    let count: usize = input.number("number of blocks")?;
    let (down, across) = (input.number("block rows")?, input.number("block columns")?);
    let (row_ends, column_ends) =
        (input.ends("block rows", down, rows)?, input.ends("block columns", across, columns)?);
    let (filled, indices) = (input.number("length of the row index")?, input.number("length of the column index")?);
    let (starts, places): (Vec<usize>, Vec<usize>) =
        (input.vector("row index", filled)?, input.vector("column index", indices)?);
    let range = |ends: &[usize], k: usize| (if k == 0 { 0 } else { ends[k - 1] }, ends[k]);
    let mut matrix = Matrix { rows, columns, entries: Vec::new() };
    if starts.last() != Some(&count) || indices != count || starts.len() > down + 1 {
        return input.bad(format!("the indices do not describe {count} blocks in {down} block rows"));
    }
    for row in 0..starts.len() - 1 {
        for k in starts[row]..starts[row + 1] {
            let (id, Some(&column)) = (input.number::<usize>("number of a block")?, places.get(k)) else {
                return input.bad(format!("block {k} has no column"));
            };
            if id != k || column >= across {
                return input.bad(format!("block {id} in column {column}, expected was block {k} in one of {across}"));
            }
            let ((top, bottom), (left, right)) = (range(&row_ends, row), range(&column_ends, column));
            for j in left..right {
                for i in top..bottom {
                    matrix.entries.push((i, j, input.number("entry of a block")?));
                }
            }
        }
    }
    Ok(matrix)
}

/// The listing of CSparse's `cs_print`, with six digits: `col J : locations …` and lines `I : X`, or lines `I J : X`.
fn csparse(input: &mut Input, rows: usize, columns: usize) -> Result<Matrix> {
    let origin: usize = input.number("kind of a compressed matrix")?;
    if ![1, 2].contains(&origin) {
        return input.bad(format!("kind {origin} of a compressed matrix must be 1 (triplets) or 2 (columns)"));
    }
    let title = input.line()?;
    if title.first() != Some(&"CSparse") {
        return input.bad("expected the title line of CSparse".to_owned());
    }
    let size = input.line()?;
    let announced = size.iter().position(|&word| word == "nnz:").and_then(|k| size.get(k + 1));
    let Some(Ok(count)) = announced.map(|word| word.trim_end_matches(',').parse::<usize>()) else {
        return input.bad("expected `nnz: COUNT`".to_owned());
    };
    let mut matrix = Matrix { rows, columns, entries: Vec::new() };
    let mut column = None;
    while matrix.entries.len() < count {
        let entry = match input.line()?[..] {
            ["col", j, ..] if origin == 2 => {
                column = j.parse().ok();
                continue;
            }
            [i, ":", x] if origin == 2 => (i.parse().ok(), column, x.parse().ok()),
            [i, j, ":", x] if origin == 1 => (i.parse().ok(), j.parse().ok(), x.parse().ok()),
            _ => (None, None, None),
        };
        let (Some(i), Some(j), Some(x)) = entry else {
            return input.bad(format!("expected entry {} of {count} of a matrix", matrix.entries.len()));
        };
        matrix.entries.push((i, j, x));
    }
    Ok(matrix)
}

/// Words, and lines where the format has them; knows where it is.
#[derive(Clone)]
struct Input<'a> {
    lines: Vec<&'a str>,
    /// Line whose words are next, from 0.
    line: usize,
    words: std::str::SplitWhitespace<'a>,
}

impl<'a> Input<'a> {
    fn new(text: &'a str) -> Input<'a> {
        let lines: Vec<&str> = text.lines().collect();
        let words = lines.first().copied().unwrap_or("").split_whitespace();
        Input { lines, line: 0, words }
    }

    fn bad<T>(&self, reason: String) -> Result<T> {
        Err(Error::Problem(format!("line {}: {reason}", self.line + 1)))
    }

    fn advance(&mut self) -> bool {
        if self.line + 1 >= self.lines.len() {
            return false;
        }
        self.line += 1;
        self.words = self.lines[self.line].split_whitespace();
        true
    }

    /// The words of the next line that has any, or of what is left of this one.
    fn line(&mut self) -> Result<Vec<&'a str>> {
        loop {
            let words: Vec<&str> = self.words.by_ref().collect();
            if !words.is_empty() {
                return Ok(words);
            }
            if !self.advance() {
                return self.bad("the file ends early".to_owned());
            }
        }
    }

    fn number<T: FromStr>(&mut self, what: &str) -> Result<T> {
        let word = loop {
            match self.words.next() {
                Some(word) => break word,
                None if self.advance() => {}
                None => return self.bad(format!("the file ends early, before {what}")),
            }
        };
        // What stands there is not said: the file may be another, and secret.
        word.parse().or_else(|_| self.bad(format!("there is no number for {what}, which is expected here")))
    }

    fn vector<T: FromStr>(&mut self, what: &str, length: usize) -> Result<Vec<T>> {
        (0..length).map(|_| self.number(what)).collect()
    }

    /// Where blocks end: ascending, up to the size of the matrix.
    fn ends(&mut self, what: &str, count: usize, size: usize) -> Result<Vec<usize>> {
        let ends: Vec<usize> = self.vector(what, count)?;
        match ends.is_sorted() && ends.last() == Some(&size) {
            true => Ok(ends),
            false => self.bad(format!("the ends of the {what} must ascend to {size}")),
        }
    }
}
