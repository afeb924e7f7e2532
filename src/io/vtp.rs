//! Snapshots for ParaView: VTK's XML PolyData with one vertex per grain, numbers as base64, and their series in time.

use super::files::{at, create};
use crate::{error::Result, scene::grain_file::Moment};
use base64::{engine::general_purpose::STANDARD, write::EncoderWriter};
use glam::DVec3;
use std::{
    fs::File,
    io::{self, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// VTK's name of a type, and its bytes.
pub(super) trait Number {
    const TYPE: &'static str;
    const BYTES: usize;
    fn put(self, out: &mut impl Write) -> io::Result<()>;
}

macro_rules! number {
    ($($type:ty = $name:literal),*) => {
        $(impl Number for $type {
            const TYPE: &'static str = $name;
            const BYTES: usize = size_of::<$type>();
            fn put(self, out: &mut impl Write) -> io::Result<()> {
                out.write_all(&self.to_le_bytes())
            }
        })*
    };
}

number!(f64 = "Float64", i64 = "Int64", u32 = "UInt32");

/// Writes a snapshot; material is the index of the material by name. clumps are told by their numbers.
pub fn write(out: &mut impl Write, moment: &Moment) -> io::Result<()> {
    let Moment { time, grains, numbers, owners, .. } = *moment;
    let count = grains.len();
    let ids = || (0..count).map(|id| id as i64);
    begin(out, count, [count, 0])?;
    writeln!(out, r#"<PointData Scalars="radius" Vectors="velocity">"#)?;
    array(out, "id", 1, (0..count).map(|k| i64::from(numbers.of_grain(k))))?;
    array(out, "radius", 1, grains.iter().map(|g| g.radius))?;
    vectors(out, "velocity", grains, |g| g.velocity)?;
    vectors(out, "angular_velocity", grains, |g| g.spin)?;
    array(out, "material", 1, grains.iter().map(|g| g.material))?;
    if !owners.is_empty() {
        array(out, "clump", 1, owners.iter().map(|owner| numbers.of_clump(*owner as usize)))?;
    }
    writeln!(out, "</PointData>\n<Points>")?;
    vectors(out, "Points", grains, |g| g.position)?;
    writeln!(out, "</Points>\n<Verts>")?;
    array(out, "connectivity", 1, ids())?;
    array(out, "offsets", 1, ids().map(|id| id + 1))?;
    writeln!(out, "</Verts>")?;
    end(out, time)
}

/// Of a file with so many points, vertices and lines.
pub(super) fn begin(out: &mut impl Write, points: usize, [verts, lines]: [usize; 2]) -> io::Result<()> {
    writeln!(out, r#"<?xml version="1.0"?>"#)?;
    writeln!(out, r#"<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">"#)?;
    writeln!(out, "<PolyData>")?;
    let others = r#"NumberOfStrips="0" NumberOfPolys="0""#;
    writeln!(out, r#"<Piece NumberOfPoints="{points}" NumberOfVerts="{verts}" NumberOfLines="{lines}" {others}>"#)
}

/// With the time, s.
pub(super) fn end(out: &mut impl Write, time: f64) -> io::Result<()> {
    writeln!(out, "</Piece>\n<FieldData>")?;
    // VTK takes it anywhere, OVITO behind the piece only.
    writeln!(
        out,
        r#"<DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">{time:?}</DataArray>"#
    )?;
    writeln!(out, "</FieldData>\n</PolyData>\n</VTKFile>")
}

pub(super) fn vectors<T>(out: &mut impl Write, name: &str, all: &[T], of: fn(&T) -> DVec3) -> io::Result<()> {
    let components: Vec<f64> = all.iter().flat_map(|x| of(x).to_array()).collect();
    array(out, name, 3, components.into_iter())
}

/// The number of bytes as UInt64 and then the bytes, encoded as one.
pub(super) fn array<T: Number>(
    out: &mut impl Write,
    name: &str,
    components: usize,
    values: impl ExactSizeIterator<Item = T>,
) -> io::Result<()> {
    let kind = T::TYPE;
    write!(out, r#"<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="binary">"#)?;
    let mut encoder = EncoderWriter::new(&mut *out, &STANDARD);
    encoder.write_all(&((values.len() * T::BYTES) as u64).to_le_bytes())?;
    for value in values {
        value.put(&mut encoder)?;
    }
    encoder.finish()?;
    drop(encoder);
    writeln!(out, "</DataArray>")
}

/// Writes the list of snapshots with their times, s, which ParaView opens as one.
pub fn write_series(out: &mut impl Write, series: &[(f64, String)]) -> io::Result<()> {
    out.write_all(BEGIN.as_bytes())?;
    series.iter().try_for_each(|(time, file)| out.write_all(entry(*time, file).as_bytes()))?;
    out.write_all(END.as_bytes())
}

const BEGIN: &str = "<?xml version=\"1.0\"?>\n\
                     <VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n";
const END: &str = "</Collection>\n</VTKFile>\n";

fn entry(time: f64, file: &str) -> String {
    format!("<DataSet timestep=\"{time:?}\" part=\"0\" file=\"{file}\"/>\n")
}

/// The file of a series that becomes longer, which can be read at any time.
pub struct Series {
    path: PathBuf,
    file: File,
    /// Bytes before its end.
    length: u64,
}

impl Series {
    /// A file with the snapshots so far.
    pub(super) fn create(path: &Path, series: &[(f64, String)]) -> Result<Series> {
        let mut text = Vec::new();
        let written = write_series(&mut text, series).and_then(|()| {
            let mut file = create(path)?;
            file.write_all(&text).map(|()| file)
        });
        let length = (text.len() - END.len()) as u64;
        written.map(|file| Series { path: path.to_owned(), file, length }).map_err(at(path))
    }

    /// One more, in the place of the end and with a new one, at once.
    pub(super) fn add(&mut self, time: f64, file: &str) -> Result<()> {
        let entry = entry(time, file);
        let text = format!("{entry}{END}");
        let written = self.file.seek(SeekFrom::Start(self.length)).and_then(|_| self.file.write_all(text.as_bytes()));
        self.length += entry.len() as u64;
        written.map_err(at(&self.path))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Grain, Numbers};

    #[test]
    fn a_series_is_whole_after_each_snapshot() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("packstone.pvd");
        let all: Vec<_> = (0..4).map(|k| (0.1 * f64::from(k), format!("snapshot_{k}.vtp"))).collect();
        let mut series = Series::create(&path, &all[..2]).unwrap();
        for k in 2..=4 {
            let mut expected = Vec::new();
            write_series(&mut expected, &all[..k]).unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), expected);
            if let Some((time, file)) = all.get(k) {
                series.add(*time, file).unwrap();
            }
        }
    }

    /// `tests/snapshots.py` shows that OVITO and VTK take this order.
    #[test]
    fn the_time_is_behind_the_piece() {
        let grain = Grain {
            position: DVec3::ONE,
            velocity: DVec3::ZERO,
            spin: DVec3::ZERO,
            radius: 0.5,
            material: 0,
            fixed: false,
        };
        let mut out = Vec::new();
        let (grains, clumps, owners, numbers) = (&[grain], &[], &[0], &Numbers::default());
        write(&mut out, &Moment { step: 0, time: 0.25, grains, clumps, owners, numbers }).unwrap();
        let text = String::from_utf8(out).unwrap();
        let elements = text.split('<').skip(1).map(|tag| tag.split([' ', '>']).next().unwrap());
        let parts: Vec<&str> = elements.filter(|name| !name.contains("DataArray")).collect();
        let order = [
            "?xml",
            "VTKFile",
            "PolyData",
            "Piece",
            "PointData",
            "/PointData",
            "Points",
            "/Points",
            "Verts",
            "/Verts",
            "/Piece",
            "FieldData",
            "/FieldData",
            "/PolyData",
            "/VTKFile",
        ];
        assert_eq!(parts, order);
    }

    #[test]
    fn an_array_is_its_length_and_its_bytes() {
        let mut out = Vec::new();
        array(&mut out, "id", 1, [1_u32, 2].into_iter()).unwrap();
        let text = String::from_utf8(out).unwrap();
        let body = text.split(['<', '>']).nth(2).unwrap();
        use base64::Engine;
        assert_eq!(STANDARD.decode(body).unwrap(), [8, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    }
}
