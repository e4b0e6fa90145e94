//! Numbers that look random and follow from where they are asked for.

/// Mixes a number's bits (the finaliser of MurmurHash3).
pub(crate) fn hash(mut bits: u32) -> u32 {
    bits ^= bits >> 16;
    bits = bits.wrapping_mul(0x85eb_ca6b);
    bits ^= bits >> 13;
    bits = bits.wrapping_mul(0xc2b2_ae35);
    bits ^ (bits >> 16)
}

/// Two numbers as one.
pub(crate) fn hash2(a: u32, b: u32) -> u32 {
    hash(a ^ hash(b).wrapping_mul(0x9e37_79b9))
}

/// From 0 to 1.
pub(crate) fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 / 16_777_216.0
}

/// A smooth field in the plane, from 0 to 1, of wave length 1.
pub(crate) fn field(x: f32, y: f32, lot: u32) -> f32 {
    let (column, row) = (x.floor(), y.floor());
    let (u, v) = (x - column, y - row);
    let at = |i: i32, j: i32| {
        unit(hash2((column as i32).wrapping_add(i) as u32 ^ lot, (row as i32).wrapping_add(j) as u32))
    };
    let ease = |t: f32| t * t * (3.0 - 2.0 * t);
    let (u, v) = (ease(u), ease(v));
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    mix(mix(at(0, 0), at(1, 0), u), mix(at(0, 1), at(1, 1), u), v)
}

/// Fields of several wave lengths, each half as long and half as strong as the one before; from 0 to 1, wave lengths shorter than
/// `finest` left out.
pub(crate) fn fields(x: f32, y: f32, wave: f32, finest: f32, lot: u32) -> f32 {
    let (mut sum, mut weight, mut wave, mut strength) = (0.0, 0.0, wave, 1.0);
    for octave in 0..5 {
        if wave < finest && octave > 0 {
            break;
        }
        sum += strength * field(x / wave, y / wave, hash(lot.wrapping_add(octave)));
        weight += strength;
        wave *= 0.5;
        strength *= 0.6;
    }
    sum / weight
}
