//! A frictional contact problem as a matrix, and how it is made from the matrices of bodies.

use crate::error::{Error, Result};
use crate::solve::operator::Operator;
use glam::{DMat2, DMat3, DVec3};
use std::collections::BTreeMap;

/// Degrees of freedom of a body at most: its block of M is factored as a full matrix.
const LARGEST_BODY: usize = 1000;

/// A sparse matrix as it comes from a file: entries (row, column, value) in any order, those of one place adding up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matrix {
    pub rows: usize,
    pub columns: usize,
    pub entries: Vec<(usize, usize, f64)>,
}

impl Matrix {
    /// From a full matrix in columns.
    pub fn dense(rows: usize, columns: usize, values: &[f64]) -> Matrix {
        let place = |(k, &value)| (k % rows, k / rows, value);
        let entries = values.iter().enumerate().map(place).filter(|e| e.2 != 0.0).collect();
        Matrix { rows, columns, entries }
    }

    fn validate(&self, name: &str, rows: usize, columns: usize) -> Result<()> {
        if (self.rows, self.columns) != (rows, columns) {
            return bad(format!("{name} is {} × {}, but must be {rows} × {columns}", self.rows, self.columns));
        }
        for &(i, j, value) in &self.entries {
            if i >= rows || j >= columns {
                return bad(format!("{name}[{i}, {j}] is outside of {rows} × {columns}"));
            }
            if !value.is_finite() {
                return bad(format!("{name}[{i}, {j}] = {value} must be finite"));
            }
        }
        Ok(())
    }
}

/// W as printed with a few digits, or of a contact law that is not quite symmetric, may differ from its transpose by this
/// fraction of its norm.
const ASYMMETRY: f64 = 5e-2;

/// Find r with `u = W r + q` and `K* ∋ u + μ‖u_T‖ n ⟂ r ∈ K_μ`: velocities u and impulses r of contacts, in blocks of
/// (n, t1, t2) or (n, t). W is symmetric and stored by rows of 3×3 blocks; blocks that are zero are not there, and in
/// the plane the places of t2 hold zeros.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    dims: usize,
    /// Where the rows begin in `columns` and `blocks`, and where the last one ends.
    starts: Vec<usize>,
    columns: Vec<u32>,
    blocks: Vec<DMat3>,
    diagonal: Vec<DMat3>,
    q: Vec<DVec3>,
    mu: Vec<f64>,
    reference: f64,
    speeds: Option<Vec<f64>>,
    asymmetry: f64,
}

fn bad<T>(reason: String) -> Result<T> {
    Err(Error::Problem(reason))
}

impl Problem {
    /// The local form: `u = W r + q`.
    ///
    /// # Errors
    /// [`Error::Problem`], naming the first entry that is wrong: sizes that do not fit, numbers that are not finite, a
    /// diagonal block that is not positive semidefinite or whose W_nn is not positive, W not symmetric, μ < 0.
    pub fn local(dims: usize, w: &Matrix, q: &[f64], mu: &[f64]) -> Result<Problem> {
        check_vectors(dims, mu, q, "q")?;
        w.validate("W", q.len(), q.len())?;
        let mut blocks = BTreeMap::<(usize, usize), DMat3>::new();
        for &(i, j, value) in &w.entries {
            if value != 0.0 {
                blocks.entry((i / dims, j / dims)).or_insert(DMat3::ZERO).col_mut(j % dims)[i % dims] += value;
            }
        }
        Problem::assemble(dims, blocks, q, mu)
    }

    /// The global form, `M v = H r + f`, `u = Hᵀ v + w`, hence `W = HᵀM⁻¹H` and `q = HᵀM⁻¹f + w`. M is block diagonal
    /// in some order of its rows: one block for each body.
    ///
    /// # Errors
    /// As above; also where M has a block that is not positive definite or larger than a body.
    pub fn global(dims: usize, m: &Matrix, h: &Matrix, f: &[f64], w: &[f64], mu: &[f64]) -> Result<Problem> {
        check_vectors(dims, mu, w, "w")?;
        check_finite("f", f)?;
        m.validate("M", f.len(), f.len())?;
        h.validate("H", f.len(), w.len())?;
        let mut rows = vec![Vec::new(); f.len()];
        for &(i, j, value) in &h.entries {
            rows[i].push((j, value));
        }
        let mut blocks = BTreeMap::<(usize, usize), DMat3>::new();
        let mut q = w.to_vec();
        for body in bodies(m)? {
            // With M = L Lᵀ: W gains XᵀX and q gains Xᵀy, where X = L⁻¹ H and y = L⁻¹ f on the rows of the body.
            let mut touched = BTreeMap::<usize, Vec<f64>>::new();
            for (k, &row) in body.rows.iter().enumerate() {
                for &(column, value) in &rows[row] {
                    touched.entry(column).or_insert_with(|| vec![0.0; body.rows.len()])[k] += value;
                }
            }
            touched.values_mut().for_each(|x| body.forward(x));
            let mut y: Vec<f64> = body.rows.iter().map(|&row| f[row]).collect();
            body.forward(&mut y);
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            for (&i, x) in &touched {
                q[i] += dot(x, &y);
                for (&j, z) in &touched {
                    blocks.entry((i / dims, j / dims)).or_insert(DMat3::ZERO).col_mut(j % dims)[i % dims] += dot(x, z);
                }
            }
        }
        Problem::assemble(dims, blocks, &q, mu)
    }

    /// The matrix of an operator, column by column, with its reference.
    ///
    /// # Errors
    /// As above.
    pub fn of<O: Operator>(operator: &O) -> Result<Problem> {
        let (n, dims) = (operator.len(), operator.dims());
        let free = operator.free();
        let q: Vec<DVec3> = (0..n).map(|k| operator.velocity(&free, k)).collect();
        let mut blocks = BTreeMap::<(usize, usize), DMat3>::new();
        for k in 0..n {
            for (axis, unit) in DVec3::AXES.into_iter().enumerate().take(dims) {
                let mut state = free.clone();
                operator.add(&mut state, k, unit);
                for j in operator.neighbours(k).chain([k]) {
                    let change = operator.velocity(&state, j) - q[j];
                    *blocks.entry((j, k)).or_insert(DMat3::ZERO).col_mut(axis) = change;
                }
            }
        }
        let flat: Vec<f64> = q.iter().flat_map(|q| q.to_array().into_iter().take(dims)).collect();
        let mu: Vec<f64> = (0..n).map(|k| operator.mu(k)).collect();
        let problem = Problem::assemble(dims, blocks, &flat, &mu)?;
        Ok(Problem { reference: operator.reference(), speeds: operator.speeds().map(<[f64]>::to_vec), ..problem })
    }

    fn assemble(dims: usize, blocks: BTreeMap<(usize, usize), DMat3>, q: &[f64], mu: &[f64]) -> Result<Problem> {
        let n = mu.len();
        let (mut symmetric, mut worst) = (BTreeMap::new(), (0.0, (0, 0)));
        let (mut norm, mut difference) = (0.0, 0.0);
        for (&(i, j), block) in &blocks {
            let mirror = blocks.get(&(j, i)).copied().unwrap_or(DMat3::ZERO).transpose();
            let apart = squares(&(*block - mirror));
            norm += squares(block);
            // Of a pair of which one block is not there, the other one counts for both.
            difference += if blocks.contains_key(&(j, i)) { apart } else { 2.0 * apart };
            if apart > worst.0 {
                worst = (apart, (i, j));
            }
            let mean = (*block + mirror) * 0.5;
            symmetric.extend([((i, j), mean), ((j, i), mean.transpose())]);
        }
        let asymmetry = if difference > 0.0 { (difference / norm).sqrt() } else { 0.0 };
        if !(asymmetry <= ASYMMETRY) {
            let (i, j) = worst.1;
            return bad(format!(
                "W is not symmetric: it differs from its transpose by {:.3} of its norm, at most {ASYMMETRY} can be \
                 mended, and most in block ({i}, {j})",
                asymmetry
            ));
        }
        let blocks = symmetric;
        let mut diagonal = Vec::with_capacity(n);
        for k in 0..n {
            let block = blocks.get(&(k, k)).copied().unwrap_or(DMat3::ZERO);
            check_diagonal(k, &block)?;
            diagonal.push(block);
        }
        let mut starts = vec![0; n + 1];
        blocks.keys().for_each(|&(i, _)| starts[i + 1] += 1);
        (0..n).for_each(|i| starts[i + 1] += starts[i]);
        let padded = |k: usize| {
            let part = &q[k * dims..(k + 1) * dims];
            DVec3::new(part[0], part[1], part.get(2).copied().unwrap_or(0.0))
        };
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !norm.is_finite() {
            return bad("the norm of q is not finite".to_owned());
        }
        Ok(Problem {
            dims,
            starts,
            columns: blocks.keys().map(|&(_, j)| j as u32).collect(),
            blocks: blocks.into_values().collect(),
            diagonal,
            q: (0..n).map(padded).collect(),
            mu: mu.to_vec(),
            // Where q = 0 so is r, and any divisor serves.
            reference: if norm > 0.0 { norm } else { 1.0 },
            speeds: None,
            asymmetry,
        })
    }

    /// Row i of W: contacts and blocks, in ascending order.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, &DMat3)> {
        let range = self.starts[i]..self.starts[i + 1];
        self.columns[range.clone()].iter().map(|&j| j as usize).zip(&self.blocks[range])
    }

    /// Blocks of W that are stored.
    pub fn blocks(&self) -> usize {
        self.blocks.len()
    }

    /// By how much W differed from its transpose, `‖W − Wᵀ‖ / ‖W‖` in Frobenius' norm; the mean of the two was taken.
    pub fn asymmetry(&self) -> f64 {
        self.asymmetry
    }

    pub fn q(&self) -> &[DVec3] {
        &self.q
    }
}

/// The state are the velocities of the contacts.
impl Operator for Problem {
    type State = Vec<DVec3>;

    fn len(&self) -> usize {
        self.mu.len()
    }

    fn dims(&self) -> usize {
        self.dims
    }

    fn block(&self, k: usize) -> DMat3 {
        self.diagonal[k]
    }

    fn mu(&self, k: usize) -> f64 {
        self.mu[k]
    }

    fn reference(&self) -> f64 {
        self.reference
    }

    fn speeds(&self) -> Option<&[f64]> {
        self.speeds.as_deref()
    }

    fn free(&self) -> Vec<DVec3> {
        self.q.clone()
    }

    fn set(&self, u: &mut Vec<DVec3>, r: &[DVec3]) {
        for (k, u) in u.iter_mut().enumerate() {
            *u = self.row(k).fold(self.q[k], |u, (j, block)| u + *block * r[j]);
        }
    }

    fn velocity(&self, u: &Vec<DVec3>, k: usize) -> DVec3 {
        u[k]
    }

    fn add(&self, u: &mut Vec<DVec3>, k: usize, change: DVec3) {
        // W is symmetric: its column k is the transpose of its row k.
        for (j, block) in self.row(k) {
            u[j] += block.transpose() * change;
        }
    }

    fn extrapolate(&self, u: &mut Vec<DVec3>, newer: &Vec<DVec3>, older: &Vec<DVec3>, beta: f64) {
        for ((u, &newer), &older) in u.iter_mut().zip(newer).zip(older) {
            *u = newer + beta * (newer - older);
        }
    }

    fn neighbours(&self, k: usize) -> impl Iterator<Item = usize> {
        self.row(k).map(|(j, _)| j)
    }
}

fn check_finite(name: &str, values: &[f64]) -> Result<()> {
    match values.iter().position(|x| !x.is_finite()) {
        Some(k) => bad(format!("{name}[{k}] = {} must be finite", values[k])),
        None => Ok(()),
    }
}

fn check_vectors(dims: usize, mu: &[f64], q: &[f64], name: &str) -> Result<()> {
    if ![2, 3].contains(&dims) {
        return bad(format!("dimension = {dims} must be 2 or 3"));
    }
    if mu.is_empty() {
        return bad("the problem has no contacts".to_owned());
    }
    if q.len() != mu.len() * dims {
        return bad(format!("{name} has {} numbers, but {} contacts need {}", q.len(), mu.len(), mu.len() * dims));
    }
    check_finite(name, q)?;
    match mu.iter().position(|&mu| !(mu >= 0.0 && mu.is_finite())) {
        Some(k) => bad(format!("mu[{k}] = {} must be finite and not negative", mu[k])),
        None => Ok(()),
    }
}

fn squares(m: &DMat3) -> f64 {
    m.to_cols_array().iter().map(|x| x * x).sum()
}

fn largest(m: &DMat3) -> f64 {
    m.to_cols_array().iter().fold(0.0, |a, x| x.abs().max(a))
}

fn check_diagonal(k: usize, w: &DMat3) -> Result<()> {
    let n = w.x_axis.x;
    if !(n > 0.0) {
        return bad(format!("block ({k}, {k}) of W: W_nn = {n:e} must be positive"));
    }
    // Eliminate the normal; what is left must have neither a negative diagonal nor a negative determinant.
    let schur = DMat2::from_cols_array(&[
        w.y_axis.y - w.y_axis.x * w.x_axis.y / n,
        w.y_axis.z - w.y_axis.x * w.x_axis.z / n,
        w.z_axis.y - w.z_axis.x * w.x_axis.y / n,
        w.z_axis.z - w.z_axis.x * w.x_axis.z / n,
    ]);
    let (zero, scale) = (-1e-6 * largest(w), largest(w));
    if schur.x_axis.x < zero || schur.y_axis.y < zero || schur.determinant() < zero * scale {
        return bad(format!("block ({k}, {k}) of W is not positive semidefinite"));
    }
    Ok(())
}

/// The rows of M that hang together, with their Cholesky factor.
struct Body {
    rows: Vec<usize>,
    /// Lower triangle, by rows.
    factor: Vec<f64>,
}

impl Body {
    /// `x ← L⁻¹ x`
    fn forward(&self, x: &mut [f64]) {
        let n = self.rows.len();
        for i in 0..n {
            let known: f64 = (0..i).map(|j| self.factor[i * n + j] * x[j]).sum();
            x[i] = (x[i] - known) / self.factor[i * n + i];
        }
    }
}

fn bodies(m: &Matrix) -> Result<Vec<Body>> {
    let mut parent: Vec<usize> = (0..m.rows).collect();
    fn root(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    let present = || m.entries.iter().filter(|e| e.2 != 0.0);
    for &(i, j, _) in present() {
        let (a, b) = (root(&mut parent, i), root(&mut parent, j));
        parent[a.max(b)] = a.min(b);
    }
    let mut groups = BTreeMap::<usize, Vec<usize>>::new();
    let mut local = vec![0; m.rows];
    for (i, place) in local.iter_mut().enumerate() {
        let group = groups.entry(root(&mut parent, i)).or_default();
        *place = group.len();
        group.push(i);
    }
    if let Some((first, rows)) = groups.iter().find(|(_, rows)| rows.len() > LARGEST_BODY) {
        let size = rows.len();
        return bad(format!("M: {size} rows from {first} on hang together; bodies have at most {LARGEST_BODY}"));
    }
    let mut full: BTreeMap<usize, Vec<f64>> = groups.iter().map(|(&k, g)| (k, vec![0.0; g.len() * g.len()])).collect();
    for &(i, j, value) in present() {
        let group = root(&mut parent, i);
        let n = groups[&group].len();
        full.get_mut(&group).expect("every group has a matrix")[local[i] * n + local[j]] += value;
    }
    groups.into_iter().zip(full.into_values()).map(|((_, rows), matrix)| factor(rows, matrix)).collect()
}

/// Cholesky's factor of a small dense matrix.
fn factor(rows: Vec<usize>, mut a: Vec<f64>) -> Result<Body> {
    let n = rows.len();
    for i in 0..n {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum();
            let rest = a[i * n + j] - known;
            if i != j {
                a[i * n + j] = rest / a[j * n + j];
            } else if rest > 0.0 {
                a[i * n + i] = rest.sqrt();
            } else {
                return bad(format!("M is not positive definite at row {}", rows[i]));
            }
        }
    }
    Ok(Body { rows, factor: a })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn diagonal(values: &[f64]) -> Matrix {
        let n = values.len();
        Matrix { rows: n, columns: n, entries: values.iter().enumerate().map(|(k, &v)| (k, k, v)).collect() }
    }

    #[test]
    fn global_and_local_form_agree() {
        // Two bodies of two degrees of freedom; M couples those of the second. Checked by hand.
        let m = Matrix {
            rows: 4,
            columns: 4,
            entries: vec![(0, 0, 2.0), (1, 1, 4.0), (2, 2, 2.0), (2, 3, 1.0), (3, 2, 1.0), (3, 3, 2.0)],
        };
        let h = Matrix { rows: 4, columns: 2, entries: vec![(0, 0, 1.0), (1, 1, 1.0), (2, 0, -1.0), (3, 1, -1.0)] };
        let problem = Problem::global(2, &m, &h, &[2.0, 4.0, 3.0, 3.0], &[0.5, 0.0], &[0.3]).unwrap();
        // M⁻¹ of the second body is (2, −1; −1, 2)/3.
        let w = problem.block(0);
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-15, "{a} {b}");
        close(w.x_axis.x, 1.0 / 2.0 + 2.0 / 3.0);
        close(w.y_axis.y, 1.0 / 4.0 + 2.0 / 3.0);
        close(w.x_axis.y, -1.0 / 3.0);
        close(problem.q()[0].x, 0.5 + 1.0 - 1.0);
        close(problem.q()[0].y, 1.0 - 1.0);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let (w, q, mu) = (diagonal(&[1.0; 4]), [0.0; 4], [0.5; 2]);
        let reason = |w: &Matrix, q: &[f64], mu: &[f64]| Problem::local(2, w, q, mu).unwrap_err().to_string();
        assert!(Problem::local(2, &w, &q, &mu).is_ok());
        assert!(reason(&w, &q[1..], &mu).contains("q has 3 numbers"));
        assert!(reason(&w, &[0.0, f64::NAN, 0.0, 0.0], &mu).contains("q[1] = NaN"));
        assert!(reason(&w, &q, &[0.1, -0.5]).contains("mu[1] = -0.5"));
        assert!(reason(&diagonal(&[1.0; 6]), &q, &mu).contains("W is 6 × 6"));
        assert!(reason(&diagonal(&[1.0, 1.0, 0.0, 1.0]), &q, &mu).contains("block (1, 1)"));
        assert!(reason(&diagonal(&[1.0, -1.0, 1.0, 1.0]), &q, &mu).contains("block (0, 0)"));
        let mut skew = w.clone();
        skew.entries.push((0, 2, 0.5));
        assert!(reason(&skew, &q, &mu).contains("not symmetric"));
        skew.entries[4] = (0, 9, 0.5);
        assert!(reason(&skew, &q, &mu).contains("W[0, 9]"));
        let m = diagonal(&[1.0, -1.0]);
        let h = Matrix { rows: 2, columns: 2, entries: vec![(0, 0, 1.0)] };
        let error = Problem::global(2, &m, &h, &[0.0; 2], &[0.0; 2], &[0.5]).unwrap_err();
        assert!(error.to_string().contains("M is not positive definite at row 1"));
    }
}
