//! Contacts as a table and, for force chains, as lines.

use super::{instant::Instant, vtp};
use crate::measure::{Contact, Other, Packing};
use glam::DVec3;
use serde::Serialize;
use std::io::{self, Write};

/// A row of `contacts.csv`, in SI units.
#[derive(Serialize)]
struct Row<'a> {
    grain: u32,
    other: Option<u32>,
    wall: Option<&'a str>,
    x: f64,
    y: f64,
    z: f64,
    nx: f64,
    ny: f64,
    nz: f64,
    overlap: f64,
    normal_x: f64,
    normal_y: f64,
    normal_z: f64,
    tangential_x: f64,
    tangential_y: f64,
    tangential_z: f64,
    dashpot: f64,
    rolling_x: f64,
    rolling_y: f64,
    rolling_z: f64,
    friction: f64,
    mobilised_friction: Option<f64>,
    sliding: bool,
}

impl<'a> Row<'a> {
    fn new(packing: &Packing<'a>, contact: &Contact) -> Row<'a> {
        let (point, n) = (packing.point(contact), contact.normal);
        let (normal, tangential) = (-contact.normal_force() * n, contact.tangential_force());
        let number = |grain: u32| packing.assembly.numbers.of_grain(grain as usize);
        let (other, wall) = match contact.other {
            Other::Grain(other) => (Some(number(other)), None),
            Other::Wall(wall) => (None, Some(packing.walls[wall as usize].name.as_str())),
        };
        Row {
            grain: number(contact.grain),
            other,
            wall,
            x: point.x,
            y: point.y,
            z: point.z,
            nx: n.x,
            ny: n.y,
            nz: n.z,
            overlap: contact.overlap,
            normal_x: normal.x,
            normal_y: normal.y,
            normal_z: normal.z,
            tangential_x: tangential.x,
            tangential_y: tangential.y,
            tangential_z: tangential.z,
            dashpot: contact.dashpot,
            rolling_x: contact.couple.x,
            rolling_y: contact.couple.y,
            rolling_z: contact.couple.z,
            friction: contact.friction,
            mobilised_friction: contact.mobilised_friction(),
            sliding: contact.sliding,
        }
    }
}

/// Columns of the table; there may be no rows that say so.
const COLUMNS: &str = "grain,other,wall,x,y,z,nx,ny,nz,overlap,normal_x,normal_y,normal_z,tangential_x,tangential_y,\
                       tangential_z,dashpot,rolling_x,rolling_y,rolling_z,friction,mobilised_friction,sliding\n";

/// All contacts, with as many digits as it takes to read the same numbers back.
pub fn write_table(out: &mut impl Write, packing: &Packing) -> io::Result<()> {
    out.write_all(COLUMNS.as_bytes())?;
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(out);
    for contact in packing.contacts {
        writer.serialize(Row::new(packing, contact))?;
    }
    writer.flush()
}

/// A line for each contact, from centre to centre, or from the centre to the wall; beside the first grain, be it beyond a
/// period.
pub fn write_lines(out: &mut impl Write, now: &Instant) -> io::Result<()> {
    let (packing, contacts) = (now.packing, now.packing.contacts);
    let ends: Vec<DVec3> = contacts.iter().flat_map(|contact| ends(packing, contact)).collect();
    let count = contacts.len();
    let each = |of: fn(&Contact) -> f64| contacts.iter().map(of).collect::<Vec<_>>().into_iter();
    let number = |grain: u32| i64::from(packing.assembly.numbers.of_grain(grain as usize));
    let other = |of: &dyn Fn(Other) -> i64| contacts.iter().map(|c| of(c.other)).collect::<Vec<_>>().into_iter();
    vtp::begin(out, 2 * count, [0, count])?;
    writeln!(out, r#"<PointData Scalars="normal_force">"#)?;
    // Filters that make tubes want what they scale by at the points.
    let twice: Vec<f64> = contacts.iter().flat_map(|c| [c.normal_force(); 2]).collect();
    vtp::array(out, "normal_force", 1, twice.into_iter())?;
    writeln!(out, r#"</PointData><CellData Scalars="normal_force">"#)?;
    vtp::array(out, "grain", 1, contacts.iter().map(|c| number(c.grain)))?;
    vtp::array(out, "other", 1, other(&|other| if let Other::Grain(id) = other { number(id) } else { -1 }))?;
    vtp::array(out, "wall", 1, other(&|other| if let Other::Wall(wall) = other { i64::from(wall) } else { -1 }))?;
    vtp::array(out, "normal_force", 1, each(Contact::normal_force))?;
    vtp::array(out, "tangential_force", 1, each(|c| c.tangential_force().length()))?;
    vtp::array(out, "overlap", 1, each(|c| c.overlap))?;
    vtp::array(out, "sliding", 1, contacts.iter().map(|c| u32::from(c.sliding)))?;
    vtp::vectors(out, "normal", contacts, |c| c.normal)?;
    vtp::vectors(out, "force", contacts, |c| c.force)?;
    writeln!(out, "</CellData>\n<Points>")?;
    vtp::vectors(out, "Points", &ends, |x| *x)?;
    writeln!(out, "</Points>\n<Lines>")?;
    vtp::array(out, "connectivity", 1, (0..2 * count).map(|k| k as i64))?;
    vtp::array(out, "offsets", 1, (0..count).map(|k| 2 * k as i64 + 2))?;
    writeln!(out, "</Lines>")?;
    vtp::end(out, now.time)
}

/// Of the line of a contact, m.
pub fn ends(packing: &Packing, contact: &Contact) -> [DVec3; 2] {
    let start = packing.grains[contact.grain as usize].position;
    let end = match contact.other {
        Other::Grain(other) => {
            let radii = packing.grains[contact.grain as usize].radius + packing.grains[other as usize].radius;
            start + (radii - contact.overlap) * contact.normal
        }
        Other::Wall(_) => packing.point(contact),
    };
    [start, end]
}
