//! Generator matrices: found by `examples/sobol_directions.rs`, checked by the tests next door.

/// Dimensions with matrices of their own.
pub(super) const DIMENSIONS: usize = 32;

/// For every dimension after the first, its primitive polynomial over GF(2) (bit k is the
/// coefficient of x^k) and the initial numbers m_1, m_2, ... of its recurrence.
#[rustfmt::skip]
pub(super) const INITIAL: [(u32, &[u32]); DIMENSIONS - 1] = [
    (0b11, &[1]),
    (0b111, &[1, 1]),
    (0b1011, &[1, 1, 1]),
    (0b1101, &[1, 3, 1]),
    (0b10011, &[1, 3, 7, 5]),
    (0b11001, &[1, 1, 3, 3]),
    (0b100101, &[1, 3, 3, 11, 17]),
    (0b101001, &[1, 3, 5, 13, 15]),
    (0b101111, &[1, 3, 5, 5, 29]),
    (0b110111, &[1, 1, 1, 3, 5]),
    (0b111011, &[1, 1, 1, 15, 21]),
    (0b111101, &[1, 1, 7, 15, 17]),
    (0b1000011, &[1, 1, 5, 7, 19, 27]),
    (0b1011011, &[1, 3, 1, 11, 1, 9]),
    (0b1100001, &[1, 3, 3, 15, 31, 7]),
    (0b1100111, &[1, 1, 5, 7, 19, 11]),
    (0b1101101, &[1, 1, 1, 1, 21, 53]),
    (0b1110011, &[1, 1, 3, 1, 25, 9]),
    (0b10000011, &[1, 3, 1, 5, 17, 59, 15]),
    (0b10001001, &[1, 3, 5, 13, 11, 23, 125]),
    (0b10001111, &[1, 3, 3, 15, 27, 3, 35]),
    (0b10010001, &[1, 1, 3, 9, 7, 63, 81]),
    (0b10011101, &[1, 1, 5, 5, 19, 19, 111]),
    (0b10100111, &[1, 3, 3, 7, 13, 29, 101]),
    (0b10101011, &[1, 3, 7, 3, 1, 35, 77]),
    (0b10111001, &[1, 1, 5, 13, 31, 3, 95]),
    (0b10111111, &[1, 1, 1, 9, 27, 55, 27]),
    (0b11000001, &[1, 3, 5, 7, 31, 35, 105]),
    (0b11001011, &[1, 3, 1, 3, 3, 31, 13]),
    (0b11010011, &[1, 3, 7, 11, 25, 25, 57]),
    (0b11010101, &[1, 3, 1, 9, 29, 9, 115]),
];

/// For every dimension, what each bit of the index does to the digits of the coordinate; the first
/// digit is the lowest bit.
#[cfg(test)]
pub(super) static DIRECTIONS: [[u32; 32]; DIMENSIONS] = directions();

/// Dimensions whose digits stand together in a table.
pub(super) const TOGETHER: usize = 4;

/// The same for every value of every four bits of the index, of some neighbouring dimensions: eight look-ups instead of 32
/// steps for each of them.
pub(super) static BY_NIBBLE: [[[[u32; TOGETHER]; 16]; 8]; DIMENSIONS / TOGETHER] = by_nibble();

const fn by_nibble() -> [[[[u32; TOGETHER]; 16]; 8]; DIMENSIONS / TOGETHER] {
    let all = directions();
    let mut table = [[[[0; TOGETHER]; 16]; 8]; DIMENSIONS / TOGETHER];
    let mut d = 0;
    while d < DIMENSIONS {
        let mut i = 0;
        while i < 32 * 16 {
            let (bit, value) = (i / 16, i % 16);
            if value >> (bit % 4) & 1 == 1 {
                table[d / TOGETHER][bit / 4][value][d % TOGETHER] ^= all[d][bit];
            }
            i += 1;
        }
        d += 1;
    }
    table
}

const fn directions() -> [[u32; 32]; DIMENSIONS] {
    let mut all = [[0; 32]; DIMENSIONS];
    let mut i = 0;
    while i < 32 {
        all[0][i] = 1 << i;
        i += 1;
    }
    let mut d = 1;
    while d < DIMENSIONS {
        let (polynomial, numbers) = INITIAL[d - 1];
        all[d] = recurrence(polynomial, numbers);
        d += 1;
    }
    all
}

/// Bratley & Fox 1988, "Algorithm 659: Implementing Sobol's quasirandom sequence generator", eq. 2,
/// on numbers with their first digit highest, then reversed.
const fn recurrence(polynomial: u32, numbers: &[u32]) -> [u32; 32] {
    let degree = numbers.len();
    let mut v = [0_u32; 32];
    let mut i = 0;
    while i < 32 {
        if i < degree {
            v[i] = numbers[i] << (31 - i);
        } else {
            v[i] = v[i - degree] ^ v[i - degree] >> degree;
            let mut k = 1;
            while k < degree {
                if polynomial >> (degree - k) & 1 == 1 {
                    v[i] ^= v[i - k];
                }
                k += 1;
            }
        }
        i += 1;
    }
    i = 0;
    while i < 32 {
        v[i] = v[i].reverse_bits();
        i += 1;
    }
    v
}
