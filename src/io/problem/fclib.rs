//! FCLIB's HDF5 format (Acary, Brémond, Heyn 2014): `/fclib_local/{W, vectors/{q, mu}, spacedim}` or
//! `/fclib_global/{M, H, vectors/{f, w, mu}, spacedim}`. A matrix is `m`, `n`, `nz`, `p`, `i`, `x`.

use crate::{
    error::{Error, Result},
    solve::{Matrix, Problem},
};
use hdf5_reader::{H5Type, Hdf5File};

pub fn parse(bytes: Vec<u8>) -> Result<Problem> {
    let file = Hdf5File::from_vec(bytes).map_err(|error| Error::Problem(error.to_string()))?;
    let root = file.root_group().map_err(|error| Error::Problem(error.to_string()))?;
    let has = |name: &str| root.group(name).is_ok();
    let form = match () {
        () if has("fclib_local") => "fclib_local",
        () if has("fclib_global") => "fclib_global",
        () => return Err(Error::Problem("the file has neither /fclib_local nor /fclib_global".to_owned())),
    };
    let form = Group { file: &file, path: form.to_owned() };
    let dims = form.integer("spacedim")?;
    let mu = form.vector("vectors/mu")?;
    if form.path == "fclib_local" {
        Problem::local(dims, &form.matrix("W")?, &form.vector("vectors/q")?, &mu)
    } else {
        let (f, w) = (form.vector("vectors/f")?, form.vector("vectors/w")?);
        Problem::global(dims, &form.matrix("M")?, &form.matrix("H")?, &f, &w, &mu)
    }
}

struct Group<'a> {
    file: &'a Hdf5File,
    path: String,
}

impl Group<'_> {
    fn bad<T>(&self, name: &str, reason: impl std::fmt::Display) -> Result<T> {
        Err(Error::Problem(format!("/{}/{name}: {reason}", self.path)))
    }

    fn vector<T: H5Type>(&self, name: &str) -> Result<Vec<T>> {
        let read = self.file.dataset(&format!("{}/{name}", self.path)).and_then(|set| set.read_array::<T>());
        read.map(|array| array.into_iter().collect()).or_else(|error| self.bad(name, error))
    }

    fn integer(&self, name: &str) -> Result<usize> {
        match self.vector::<i32>(name)?[..] {
            [value] if value >= 0 => Ok(value as usize),
            _ => self.bad(name, "must be one number that is not negative"),
        }
    }

    fn indices(&self, name: &str) -> Result<Vec<usize>> {
        let index = |k: i32| usize::try_from(k).or_else(|_| self.bad(name, format!("index {k} must not be negative")));
        self.vector::<i32>(name)?.into_iter().map(index).collect()
    }

    fn matrix(&self, name: &str) -> Result<Matrix> {
        let member = |part: &str| format!("{name}/{part}");
        let (rows, columns) = (self.integer(&member("m"))?, self.integer(&member("n"))?);
        let (i, p) = (self.indices(&member("i"))?, self.indices(&member("p"))?);
        let x: Vec<f64> = self.vector(&member("x"))?;
        let kind = match self.vector::<i32>(&member("nz"))?[..] {
            [kind] => kind,
            _ => return self.bad(&member("nz"), "must be one number"),
        };
        let entries = match kind {
            0.. if i.len() >= kind as usize && p.len() >= kind as usize && x.len() >= kind as usize => {
                (0..kind as usize).map(|k| (i[k], p[k], x[k])).collect()
            }
            -2 | -1 => {
                let lines = if kind == -2 { rows } else { columns };
                let count = p.last().copied().unwrap_or(0);
                if p.len() != lines + 1 || !p.is_sorted() || count > i.len() || count > x.len() {
                    return self.bad(&member("p"), "does not fit to the size of the matrix");
                }
                let line = (0..lines).flat_map(|line| (p[line]..p[line + 1]).map(move |k| (line, k)));
                line.map(|(line, k)| if kind == -2 { (line, i[k], x[k]) } else { (i[k], line, x[k]) }).collect()
            }
            _ => return self.bad(&member("nz"), format!("{kind} does not fit to the lengths of i, p and x")),
        };
        Ok(Matrix { rows, columns, entries })
    }
}
