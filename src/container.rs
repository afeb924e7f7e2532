//! Columns of numbers in a binary file, named, typed and checksummed: `docs/output.md` has it byte by byte.
//!
//! A file says what it holds before it holds it, so that it is written in one go, without a second copy of the content,
//! and what is missing or altered shows when it is read.

use crate::error::{Error, Result};
use crc32fast::Hasher;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::{
    fs::File,
    io::{self, BufReader, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// What every such file begins with. Its first byte is no ASCII, and whoever changes the ends of lines changes it.
pub const MAGIC: [u8; 8] = *b"\x89PACK\r\n\x1a";
/// Of the format; readers know this one and none above.
const VERSION: u32 = 1;
/// Bytes of magic number, version and the header's length.
const PREAMBLE: usize = 16;
/// A header is no longer, whatever an altered file says.
const LONGEST_HEADER: u32 = 1 << 24;
/// Bytes that are encoded, or decoded, at a time.
const BLOCK: usize = 1 << 16;

/// A type of numbers, little-endian.
pub trait Number: Copy {
    /// As the header has it: the name in Rust and numpy.
    const TYPE: &'static str;
    const BYTES: usize;
    fn encode(self, bytes: &mut Vec<u8>);
    fn decode(bytes: &[u8]) -> Self;
}

macro_rules! number {
    ($($type:ty = $name:literal),*) => {
        $(impl Number for $type {
            const TYPE: &'static str = $name;
            const BYTES: usize = size_of::<$type>();
            fn encode(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
            fn decode(bytes: &[u8]) -> $type {
                <$type>::from_le_bytes(bytes.try_into().expect("as many bytes as the type has"))
            }
        })*
    };
}

number!(f64 = "float64", u32 = "uint32");

/// What the header says of a column.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Description {
    pub name: String,
    #[serde(rename = "type")]
    pub number: String,
    /// Numbers in a row.
    pub components: u64,
    pub rows: u64,
    pub unit: String,
}

impl Description {
    /// Bytes of the column without its checksum; None if no file can be as long, or there is nothing in a row.
    fn bytes(&self) -> Option<u64> {
        if self.components == 0 {
            return None;
        }
        let of_number = match &*self.number {
            f64::TYPE => f64::BYTES,
            u32::TYPE => u32::BYTES,
            _ => return None,
        };
        self.rows.checked_mul(self.components)?.checked_mul(of_number as u64)
    }
}

/// Takes blocks of bytes.
type Sink<'s> = dyn FnMut(&[u8]) -> io::Result<()> + 's;

/// Feeds it the bytes of a column.
type Encode<'a> = Box<dyn Fn(&mut Sink) -> io::Result<()> + 'a>;

/// A column to be written.
pub struct Column<'a> {
    description: Description,
    /// Feeds blocks of its bytes.
    encode: Encode<'a>,
}

impl<'a> Column<'a> {
    /// What `of` makes of each of the rows.
    pub fn new<R, T: Number, const N: usize>(
        name: &str,
        unit: &str,
        rows: &'a [R],
        of: impl Fn(&R) -> [T; N] + 'a,
    ) -> Column<'a> {
        let description = Description {
            name: name.to_owned(),
            number: T::TYPE.to_owned(),
            components: N as u64,
            rows: rows.len() as u64,
            unit: unit.to_owned(),
        };
        let encode = move |sink: &mut Sink| {
            let mut block = Vec::with_capacity(BLOCK);
            rows.chunks(BLOCK / (N * T::BYTES)).try_for_each(|rows| {
                block.clear();
                rows.iter().flat_map(&of).for_each(|number| number.encode(&mut block));
                sink(&block)
            })
        };
        Column { description, encode: Box::new(encode) }
    }
}

/// A header: what the kind of file has to say besides, then the columns.
#[derive(Serialize, Deserialize)]
struct Header<A> {
    #[serde(flatten)]
    about: A,
    columns: Vec<Description>,
}

/// Write a file: what there is to say besides the columns, and these.
pub fn write(out: &mut impl Write, about: &impl Serialize, columns: &[Column]) -> io::Result<()> {
    let descriptions = columns.iter().map(|column| column.description.clone()).collect();
    let mut file = Writer::begin(out, about, descriptions)?;
    columns.iter().try_for_each(|column| {
        (column.encode)(&mut |block| file.bytes(block))?;
        file.end_column()
    })
}

/// Writes a file column by column, for those who do not have all of a column at once.
pub struct Writer<W> {
    out: W,
    /// Of the column that is being written.
    hasher: Hasher,
}

impl<W: Write> Writer<W> {
    /// Write the header. The columns have to be as they are described.
    pub fn begin(mut out: W, about: &impl Serialize, columns: Vec<Description>) -> io::Result<Writer<W>> {
        let header = serde_json::to_vec(&Header { about, columns })?;
        if header.len() > LONGEST_HEADER as usize {
            return Err(io::Error::other(format!(
                "names take {} bytes, {LONGEST_HEADER} at most are written",
                header.len()
            )));
        }
        let head = [&MAGIC[..], &VERSION.to_le_bytes(), &(header.len() as u32).to_le_bytes(), &header].concat();
        out.write_all(&head)?;
        out.write_all(&crc32fast::hash(&head).to_le_bytes())?;
        Ok(Writer { out, hasher: Hasher::new() })
    }

    /// The next bytes of a column.
    pub fn bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.hasher.update(bytes);
        self.out.write_all(bytes)
    }

    /// The column is whole.
    pub fn end_column(&mut self) -> io::Result<()> {
        let checksum = std::mem::take(&mut self.hasher).finalize();
        self.out.write_all(&checksum.to_le_bytes())
    }
}

/// Whether there is a file that begins as these do, even if it has been changed as text since. What can be read only
/// once, as a pipe, is left alone.
pub fn is_container(path: &Path) -> bool {
    let mut begin = [0; 5];
    path.is_file()
        && File::open(path).is_ok_and(|mut file| file.read_exact(&mut begin).is_ok())
        && begin == MAGIC[..begin.len()]
}

/// A file whose header has been read.
#[derive(Debug)]
pub struct Container<A> {
    path: PathBuf,
    file: BufReader<File>,
    pub about: A,
    /// With their places in the file.
    columns: Vec<(Description, u64)>,
}

impl<A: DeserializeOwned> Container<A> {
    /// Read a header, and see whether the file is as long as it says.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read, [`Error::Scene`] if it is something else, is cut off or altered.
    pub fn open(path: &Path) -> Result<Container<A>> {
        let io = |source| Error::Io { path: path.to_owned(), source };
        let wrong = |message: String| Error::Scene(format!("{}: {message}", path.display()));
        let file = File::open(path).map_err(io)?;
        let length = file.metadata().map_err(io)?.len();
        let mut file = BufReader::with_capacity(BLOCK, file);
        let mut bytes = vec![0; PREAMBLE];
        let cut = |needed: u64| wrong(format!("is cut off: it has {length} bytes, and {needed} or more are needed"));
        if length < PREAMBLE as u64 {
            return Err(cut(PREAMBLE as u64));
        }
        file.read_exact(&mut bytes).map_err(io)?;
        if bytes[..8] != MAGIC {
            return Err(wrong("is no binary file of packstone, or has been changed as if it were text".to_owned()));
        }
        let (version, header) = (u32::decode(&bytes[8..12]), u32::decode(&bytes[12..]));
        if version > VERSION {
            return Err(wrong(format!("has version {version} of the format; this packstone reads up to {VERSION}")));
        }
        let begin = PREAMBLE as u64 + u64::from(header) + 4;
        if length < begin && header <= LONGEST_HEADER {
            return Err(cut(begin));
        }
        let damaged = || wrong("is damaged: the checksum of its header is another".to_owned());
        if header > LONGEST_HEADER {
            return Err(damaged());
        }
        bytes.resize(PREAMBLE + header as usize, 0);
        file.read_exact(&mut bytes[PREAMBLE..]).map_err(io)?;
        let mut checksum = [0; 4];
        file.read_exact(&mut checksum).map_err(io)?;
        if crc32fast::hash(&bytes) != u32::decode(&checksum) {
            return Err(damaged());
        }
        let header: Header<A> =
            serde_json::from_slice(&bytes[PREAMBLE..]).map_err(|e| wrong(format!("header: {e}")))?;
        let mut columns = Vec::new();
        let mut end = begin;
        for column in header.columns {
            let long =
                || wrong(format!("column \"{}\" is of a type or length that this packstone cannot read", column.name));
            let next = column.bytes().and_then(|bytes| end.checked_add(bytes)?.checked_add(4)).ok_or_else(long)?;
            columns.push((column, end));
            end = next;
        }
        match length {
            _ if length < end => Err(wrong(format!("is cut off: it has {length} of {end} bytes"))),
            _ if length > end => Err(wrong(format!("has {length} bytes, but should have {end}"))),
            _ => Ok(Container { path: path.to_owned(), file, about: header.about, columns }),
        }
    }
}

impl<A> Container<A> {
    /// Rows of a column, if it is there.
    pub fn rows(&self, name: &str) -> Option<u64> {
        self.columns.iter().find(|(column, _)| column.name == name).map(|(column, _)| column.rows)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the header says of the columns.
    pub fn descriptions(&self) -> impl Iterator<Item = &Description> {
        self.columns.iter().map(|(column, _)| column)
    }

    /// Read a column, row by row. Whether it has been altered is known in the end only.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read, [`Error::Scene`] if it is not there, of another type, or altered.
    pub fn read<T: Number, const N: usize>(&mut self, name: &str, mut row: impl FnMut(usize, [T; N])) -> Result<()> {
        let Description { number, components, .. } = self.description(name)?;
        if number != T::TYPE || *components != N as u64 {
            let message = format!("column \"{name}\" is {number} x {components}, must be {} x {N}", T::TYPE);
            return Err(self.wrong(message));
        }
        let of_row = N * T::BYTES;
        self.blocks(name, BLOCK / of_row, |first, bytes| {
            for (k, numbers) in bytes.chunks_exact(of_row).enumerate() {
                row(first + k, std::array::from_fn(|k| T::decode(&numbers[k * T::BYTES..][..T::BYTES])));
            }
            Ok(())
        })
    }

    /// Read a column of whatever type, so many rows at a time: the number of the first, and all numbers of these rows.
    /// Whether it has been altered is known in the end only.
    ///
    /// # Errors
    /// As [`Container::read`], and what `piece` says.
    pub fn read_pieces(
        &mut self,
        name: &str,
        rows: usize,
        mut piece: impl FnMut(usize, &[f64]) -> Result<()>,
    ) -> Result<()> {
        let whole = self.description(name)?.number == u32::TYPE;
        let mut numbers = Vec::new();
        self.blocks(name, rows, |first, bytes| {
            numbers.clear();
            match whole {
                true => numbers.extend(bytes.chunks_exact(u32::BYTES).map(|bytes| f64::from(u32::decode(bytes)))),
                false => numbers.extend(bytes.chunks_exact(f64::BYTES).map(f64::decode)),
            }
            piece(first, &numbers)
        })
    }

    fn description(&self, name: &str) -> Result<&Description> {
        let found = self.descriptions().find(|column| column.name == name);
        found.ok_or_else(|| self.wrong(format!("has no column \"{name}\"")))
    }

    /// What is wrong with the file, by its name.
    pub fn wrong(&self, message: String) -> Error {
        Error::Scene(format!("{}: {message}", self.path.display()))
    }

    /// The bytes of a column that there is, so many rows at a time.
    fn blocks(&mut self, name: &str, rows: usize, mut block: impl FnMut(usize, &[u8]) -> Result<()>) -> Result<()> {
        let place = self.columns.iter().find(|(column, _)| column.name == name);
        let (column, begin) = place.expect("asked for before");
        let of_row = (column.bytes().unwrap_or(0) / column.rows.max(1)) as usize;
        let (len, begin) = (column.rows as usize, *begin);
        let path = self.path.clone();
        let io = |source| Error::Io { path: path.clone(), source };
        self.file.seek(SeekFrom::Start(begin)).map_err(io)?;
        let (mut hasher, mut bytes) = (Hasher::new(), Vec::new());
        for first in (0..len).step_by(rows.max(1)) {
            bytes.resize((len - first).min(rows.max(1)) * of_row, 0);
            self.file.read_exact(&mut bytes).map_err(io)?;
            hasher.update(&bytes);
            block(first, &bytes)?;
        }
        let mut checksum = [0; 4];
        self.file.read_exact(&mut checksum).map_err(io)?;
        match hasher.finalize() == u32::decode(&checksum) {
            true => Ok(()),
            false => Err(self.wrong(format!("is damaged: the checksum of column \"{name}\" is another"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};
    use std::fs;

    const POINTS: [[f64; 3]; 2] = [[0.1, -0.0, f64::MIN_POSITIVE], [1e300, f64::NAN, 5e-324]];

    fn file() -> Vec<u8> {
        let mut bytes = Vec::new();
        let columns = [
            Column::new("point", "m", &POINTS, |p| *p),
            Column::new("number", "", &[7_u32, u32::MAX, 0], |n| [*n]),
            Column::new("nothing", "", &[], |n: &u32| [*n]),
        ];
        write(&mut bytes, &json!({ "kind": "test" }), &columns).unwrap();
        bytes
    }

    /// What a file of these bytes holds.
    fn content(bytes: &[u8]) -> Result<(Value, Vec<u64>, Vec<u32>)> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("some.bin");
        fs::write(&path, bytes).unwrap();
        let mut file = Container::<Value>::open(&path)?;
        let (mut points, mut numbers) = (Vec::new(), Vec::new());
        file.read("number", |_, [n]: [u32; 1]| numbers.push(n))?;
        file.read("point", |k, point: [f64; 3]| {
            assert_eq!(points.len(), 3 * k);
            points.extend(point.map(f64::to_bits));
        })?;
        file.read("nothing", |_, [_]: [u32; 1]| panic!("has no rows"))?;
        Ok((file.about, points, numbers))
    }

    #[test]
    fn every_bit_survives() {
        let (about, points, numbers) = content(&file()).unwrap();
        assert_eq!(about["kind"], "test");
        assert_eq!(points, POINTS.concat().iter().map(|x| x.to_bits()).collect::<Vec<_>>());
        assert_eq!(numbers, [7, u32::MAX, 0]);
    }

    #[test]
    fn columns_longer_than_a_block_are_whole() {
        let rows: Vec<u32> = (0..100_000).collect();
        let mut bytes = Vec::new();
        write(&mut bytes, &json!({}), &[Column::new("row", "", &rows, |row| [*row, 2 * row, 3 * row])]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.bin");
        fs::write(&path, bytes).unwrap();
        let (mut file, mut seen) = (Container::<Value>::open(&path).unwrap(), 0);
        file.read("row", |k, row: [u32; 3]| {
            assert_eq!(row, [k as u32, 2 * k as u32, 3 * k as u32]);
            seen += 1;
        })
        .unwrap();
        assert_eq!(seen, rows.len());
    }

    #[test]
    fn nothing_is_read_of_a_file_that_is_cut_off_or_altered() {
        let whole = file();
        for length in 0..whole.len() {
            let message = content(&whole[..length]).unwrap_err().to_string();
            assert!(message.contains("some.bin: is cut off"), "{length} bytes: {message}");
        }
        let message = content(&[&whole[..], &[0]].concat()).unwrap_err().to_string();
        assert!(message.contains("bytes, but should have"), "{message}");
        for (at, bit) in (0..whole.len()).flat_map(|at| (0..8).map(move |bit| (at, bit))) {
            let mut altered = whole.clone();
            altered[at] ^= 1 << bit;
            let message = content(&altered).unwrap_err().to_string();
            let known = ["is damaged", "is cut off", "is no binary file", "has version"];
            assert!(known.iter().any(|part| message.contains(part)), "bit {bit} of byte {at}: {message}");
        }
    }

    /// A row without numbers would make any number of rows fit.
    #[test]
    fn no_number_of_rows_comes_from_nothing() {
        let header = json!({ "columns": [{ "name": "n", "type": "float64", "components": 0, "rows": 1_u64 << 60, "unit": "" }] });
        let header = serde_json::to_vec(&header).unwrap();
        let head = [&MAGIC[..], &VERSION.to_le_bytes(), &(header.len() as u32).to_le_bytes(), &header].concat();
        let message =
            content(&[&head[..], &crc32fast::hash(&head).to_le_bytes(), &[0; 4]].concat()).unwrap_err().to_string();
        assert!(message.contains("column \"n\" is of a type or length"), "{message}");
    }

    #[test]
    fn what_is_not_there_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("some.bin");
        fs::write(&path, file()).unwrap();
        let mut file = Container::<Value>::open(&path).unwrap();
        assert_eq!((file.rows("number"), file.rows("mass")), (Some(3), None));
        let missing = file.read("mass", |_, [_]: [f64; 1]| ()).unwrap_err().to_string();
        assert!(missing.contains("has no column \"mass\""), "{missing}");
        let other = file.read("point", |_, [_]: [u32; 1]| ()).unwrap_err().to_string();
        assert!(other.contains("column \"point\" is float64 x 3, must be uint32 x 1"), "{other}");
    }
}
