//! `--bus`: which black channel commands which axis.

use shm_schema::exchange::Bus;

use super::options::number;

/// `AXIS=fsoe:ADDRESS:SESSION,AXIS=profisafe:ADDRESS`, decimal; `:sra` behind the session: the
/// master has to send the SRA CRC.
///
/// # Errors
/// One line: what was found and what is expected.
pub fn buses(name: &str, value: &str) -> Result<Vec<(u8, Bus)>, String> {
    let mut found: Vec<(u8, Bus)> = Vec::new();
    for part in value.split(',') {
        let (axis, bus) = one(name, part)?;
        if found.iter().any(|(known, _)| *known == axis) {
            return Err(format!("{name} {value}: axis {axis} is named twice"));
        }
        found.push((axis, bus));
    }
    Ok(found)
}

fn one(name: &str, part: &str) -> Result<(u8, Bus), String> {
    let wrong =
        || format!("{name} {part}: AXIS=fsoe:ADDRESS:SESSION[:sra] or AXIS=profisafe:ADDRESS expected");
    let (axis, bus) = part.split_once('=').ok_or_else(wrong)?;
    let axis = number(name, axis, 1, 64)?;
    let fields: Vec<&str> = bus.split(':').collect();
    let bus = match fields.as_slice() {
        ["fsoe", address, session, extra @ ..] => Bus::Fsoe {
            address: number(name, address, 1, u16::MAX)?,
            session_id: number(name, session, 0, u16::MAX)?,
            sra: match extra {
                [] => false,
                ["sra"] => true,
                _ => return Err(wrong()),
            },
        },
        ["profisafe", address] => Bus::Profisafe { address: number(name, address, 1, u16::MAX - 1)? },
        _ => return Err(wrong()),
    };
    Ok((axis, bus))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_axis_has_one_bus_or_the_option_is_refused() {
        assert_eq!(buses("--bus", "1=profisafe:65534"), Ok(vec![(1, Bus::Profisafe { address: 65_534 })]));
        for wrong in [
            "",
            "1",
            "1=fsoe:5",
            "1=fsoe:0:5",
            "1=fsoe:1:5:no",
            "1=fsoe:1:5:sra:sra",
            "65=fsoe:1:1",
            "1=profisafe:65535",
            "1=can:5",
        ] {
            assert!(buses("--bus", wrong).is_err(), "{wrong}");
        }
        assert!(buses("--bus", "1=fsoe:1:1,1=fsoe:2:1").is_err());
    }
}
