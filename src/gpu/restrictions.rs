//! What a device is taken not to have, so that one can see on any device how packstone fares on a lesser one.

use std::{fmt, str::FromStr};
use wgpu::{Features, Limits};

/// The default takes nothing away.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Restrictions {
    /// Largest part of a buffer that a kernel can see, bytes.
    pub binding_bytes: Option<u64>,
    /// Storage buffers that a kernel can see.
    pub storage_buffers: Option<u32>,
    pub no_timestamps: bool,
    /// No kernel uses them, so this changes only what the device is said to have.
    pub no_subgroups: bool,
    /// Submissions that the device lives to see.
    pub lost_after: Option<u64>,
}

impl Restrictions {
    /// What is left of an adapter's limits.
    pub fn limits(&self, of_adapter: Limits) -> Limits {
        let (bytes, buffers) =
            (of_adapter.max_storage_buffer_binding_size, of_adapter.max_storage_buffers_per_shader_stage);
        Limits {
            max_storage_buffer_binding_size: self.binding_bytes.map_or(bytes, |most| bytes.min(most)),
            max_storage_buffers_per_shader_stage: self.storage_buffers.map_or(buffers, |most| buffers.min(most)),
            ..of_adapter
        }
    }

    /// What is left of an adapter's features.
    pub fn features(&self, of_adapter: Features) -> Features {
        let taken = [(self.no_timestamps, Features::TIMESTAMP_QUERY), (self.no_subgroups, Features::SUBGROUP)];
        taken.into_iter().filter(|(taken, _)| *taken).fold(of_adapter, |left, (_, feature)| left - feature)
    }
}

impl fmt::Display for Restrictions {
    /// As it is read.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = |name, value: Option<u64>| value.map(|value| format!("{name}={value}"));
        let word = |name: &str, set: bool| set.then(|| name.to_owned());
        let all = [
            number("binding-bytes", self.binding_bytes),
            number("storage-buffers", self.storage_buffers.map(u64::from)),
            number("lost-after", self.lost_after),
            word("no-timestamps", self.no_timestamps),
            word("no-subgroups", self.no_subgroups),
        ];
        write!(f, "{}", all.into_iter().flatten().collect::<Vec<_>>().join(","))
    }
}

impl FromStr for Restrictions {
    type Err = String;

    /// `binding-bytes=N`, `storage-buffers=N`, `lost-after=N`, `no-timestamps`, `no-subgroups`, with commas between
    /// them.
    fn from_str(text: &str) -> std::result::Result<Restrictions, String> {
        let mut all = Restrictions::default();
        for item in text.split(',').map(str::trim) {
            let (name, value) = item.split_once('=').map_or((item, None), |(name, value)| (name, Some(value)));
            let number = || {
                let number = value.and_then(|value| value.parse::<u64>().ok());
                number.ok_or_else(|| format!("`{item}`: {name} needs a whole number, {name}=N"))
            };
            match (name, value) {
                ("binding-bytes", _) => all.binding_bytes = Some(number()?),
                ("storage-buffers", _) => {
                    all.storage_buffers = Some(u32::try_from(number()?).map_err(|e| format!("`{item}`: {e}"))?);
                }
                ("lost-after", _) => all.lost_after = Some(number()?),
                ("no-timestamps", None) => all.no_timestamps = true,
                ("no-subgroups", None) => all.no_subgroups = true,
                _ => {
                    return Err(format!(
                        "there is no restriction `{item}`; there are binding-bytes=N, storage-buffers=N, lost-after=N, \
                         no-timestamps and no-subgroups"
                    ));
                }
            }
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn restrictions_are_read_and_only_take_away() {
        let all = "binding-bytes=1048576, storage-buffers=8,lost-after=3,no-timestamps,no-subgroups";
        let restrictions: Restrictions = all.parse().unwrap();
        let limits = restrictions.limits(Limits::default());
        assert_eq!((limits.max_storage_buffer_binding_size, limits.max_storage_buffers_per_shader_stage), (1 << 20, 8));
        assert_eq!(restrictions.lost_after, Some(3));
        assert_eq!(restrictions.to_string().parse(), Ok(restrictions));
        let features = Features::TIMESTAMP_QUERY | Features::SUBGROUP | Features::SHADER_F64;
        assert_eq!(restrictions.features(features), Features::SHADER_F64);
        let more: Restrictions = "binding-bytes=99999999999,storage-buffers=99".parse().unwrap();
        assert_eq!(more.limits(Limits::default()), Limits::default());
        assert_eq!(Restrictions::default().features(features), features);
    }

    #[test]
    fn wrong_restrictions_are_refused() {
        for (text, word) in [
            ("", "no restriction ``"),
            ("buffers=8", "no restriction `buffers=8`"),
            ("storage-buffers", "needs a whole number"),
            ("storage-buffers=-1", "needs a whole number"),
            ("storage-buffers=5000000000", "out of range"),
            ("no-timestamps=1", "no restriction"),
        ] {
            let error = text.parse::<Restrictions>().unwrap_err();
            assert!(error.contains(word), "{text}: {error}");
        }
    }
}
