//! Single-precision addition and multiplication for a core without a floating-point unit, in the place of the
//! compiler's own, which take longer (`tests/device_cost.rs`).
//!
//! Rounded to nearest, ties to even, as IEEE 754 wants it, so that no bit of any result changes: `crate::replay` holds
//! them against the host's. What is not a normal number, or may become none, goes a longer way, zeros apart.
//!
//! In assembly, since eight registers are all there is, and the compiler spills them.
#![allow(unsafe_code)] // Assembly, and the names that it calls.

const SIGN: u32 = 1 << 31;
const INFINITY: u32 = 0x7F80_0000;
const NAN: u32 = 0x7FC0_0000;
/// The leading one of a significand that ends with bit 0.
const ONE: u32 = 1 << 23;

/// Exponent, and the significand with its leading one, if it has one: a subnormal number's exponent is 1.
fn parts(bits: u32) -> (i32, u32) {
    let (exponent, fraction) = (bits << 1 >> 24, bits & (ONE - 1));
    if exponent == 0 { (1, fraction) } else { (exponent as i32, fraction | ONE) }
}

/// Rounds `sum · 2^(exponent − 127 − 30)`, of which the lowest bit stands for all below.
fn rounded(sign: u32, mut exponent: i32, mut sum: u32) -> u32 {
    if sum == 0 {
        return sign;
    }
    exponent += 1;
    while sum < SIGN && exponent > 1 {
        sum <<= 1;
        exponent -= 1;
    }
    while exponent < 1 {
        sum = sum >> 1 | sum & 1;
        exponent += 1;
    }
    let (mut significand, below) = (sum >> 8, sum << 24);
    if below > SIGN || below == SIGN && significand & 1 != 0 {
        significand += 1;
    }
    // A leading one counts into the exponent.
    let bits = ((exponent as u32 - 1) << 23) + significand;
    sign | if exponent >= 255 { INFINITY } else { bits }
}

/// The product of any two numbers.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn imucal_any_product(a: u32, b: u32) -> u32 {
    let (sign, x, y) = ((a ^ b) & SIGN, a & !SIGN, b & !SIGN);
    if x > INFINITY || y > INFINITY {
        return NAN;
    }
    if x == INFINITY || y == INFINITY {
        return if x == 0 || y == 0 { NAN } else { sign | INFINITY };
    }
    let ((mut ex, mut x), (ey, mut y)) = (parts(x), parts(y));
    // Up, so that no bit of a subnormal number's product is lost below.
    for small in [&mut x, &mut y] {
        while *small < ONE && *small > 0 {
            *small <<= 1;
            ex -= 1;
        }
    }
    let (xh, xl, yh, yl) = (x >> 8, x & 0xFF, y >> 8, y & 0xFF);
    let low = xl * yl;
    let middle = xh * yl + xl * yh + (low >> 8);
    let high = xh * yh + (middle >> 8);
    rounded(sign, ex + ey - 127, high | u32::from((low | middle) & 0xFF != 0))
}

/// The sum of any two numbers.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn imucal_any_sum(a: u32, b: u32) -> u32 {
    let (a, b) = if a << 1 < b << 1 { (b, a) } else { (a, b) };
    let opposite = (a ^ b) & SIGN != 0;
    if a & !SIGN >= INFINITY {
        let none = a & !SIGN > INFINITY || opposite && b & !SIGN == INFINITY;
        return if none { NAN } else { a };
    }
    let ((exponent, x), (small, y)) = (parts(a), parts(b));
    let (x, mut y) = (x << 7, y << 7);
    for _ in small..exponent {
        y = y >> 1 | y & 1;
    }
    let sum = if opposite { x - y } else { x + y };
    // What cancels is +0; of two zeros of one sign, that.
    rounded(if sum == 0 { a & b & SIGN } else { a & SIGN }, exponent, sum)
}

// Significands are 1.fraction. The sign stands above the exponent, so that both go into the result in one addition; the
// leading one of the significand, and what rounding carries, count into the exponent.
core::arch::global_asm!(
    "
    .section .text.imucal_soft_float, \"ax\", %progbits
    .p2align 2

    .global __aeabi_fmul
    .type __aeabi_fmul, %function
    .thumb_func
__aeabi_fmul:
    push  {{r4, r5, r6, lr}}
    lsrs  r2, r0, #23
    lsrs  r3, r1, #23
    uxtb  r4, r2
    uxtb  r5, r3
    subs  r6, r4, #1
    cmp   r6, #253
    bhi   4f
    subs  r6, r5, #1
    cmp   r6, #253
    bhi   4f
    adds  r4, r4, r5
    subs  r4, #128
    cmp   r4, #252              // the product is normal, whatever its significand
    bhi   6f
    adds  r2, r2, r3
    subs  r2, #127
    uxtb  r4, r0                // significands of 24 bits: 16 and 8, since a product keeps 32
    uxtb  r5, r1
    movs  r3, #1
    lsls  r3, r3, #31
    lsls  r0, r0, #8
    orrs  r0, r3
    lsrs  r0, r0, #16
    lsls  r1, r1, #8
    orrs  r1, r3
    lsrs  r1, r1, #16
    movs  r3, r4
    muls  r3, r5, r3            // low
    muls  r4, r1, r4
    muls  r5, r0, r5
    adds  r4, r4, r5
    lsrs  r5, r3, #8
    adds  r4, r4, r5            // middle
    muls  r0, r1, r0
    lsrs  r5, r4, #8
    adds  r0, r0, r5            // high, from 1 to 4, the point behind bit 30
    bmi   1f
    adds  r0, r0, r0
    subs  r2, #1
1:  lsls  r2, r2, #23
    lsrs  r1, r0, #8            // the first bit that goes is the carry
    bcc   3f
    lsls  r5, r0, #25
    bne   2f
    orrs  r3, r4
    lsls  r3, r3, #24
    bne   2f
    lsrs  r5, r1, #1            // a tie: to even
    bcc   3f
2:  adds  r1, #1
3:  adds  r0, r1, r2
    pop   {{r4, r5, r6, pc}}
4:  cmp   r4, #255              // zero times a number is a zero
    beq   6f
    cmp   r5, #255
    beq   6f
    lsls  r2, r0, #1
    beq   5f
    lsls  r2, r1, #1
    bne   6f
5:  eors  r0, r1
    lsrs  r0, r0, #31
    lsls  r0, r0, #31
    pop   {{r4, r5, r6, pc}}
6:  bl    imucal_any_product
    pop   {{r4, r5, r6, pc}}
    .size __aeabi_fmul, . - __aeabi_fmul

    .global __aeabi_fsub
    .type __aeabi_fsub, %function
    .thumb_func
__aeabi_fsub:
    movs  r2, #1
    lsls  r2, r2, #31
    eors  r1, r2

    .global __aeabi_fadd
    .type __aeabi_fadd, %function
    .thumb_func
__aeabi_fadd:
    push  {{r4, r5, r6, lr}}
    lsls  r2, r0, #1
    lsls  r3, r1, #1
    cmp   r2, r3                // the larger one is the first
    bhs   1f
    movs  r4, r0
    movs  r0, r1
    movs  r1, r4
    movs  r4, r2
    movs  r2, r3
    movs  r3, r4
1:  lsrs  r2, r2, #24
    lsrs  r3, r3, #24
    beq   8f
    cmp   r2, #254
    bhs   9f
    subs  r3, r2, r3
    movs  r4, r0
    eors  r4, r1
    bpl   2f
    cmp   r2, #31               // the difference is normal, however small
    bls   9f
2:  cmp   r3, #25               // less than a quarter of the last place
    bhi   7f
    lsrs  r2, r0, #23
    movs  r5, #1
    lsls  r5, r5, #30
    lsls  r0, r0, #9            // the point behind bit 30: room for a carry, and seven bits below
    lsrs  r0, r0, #2
    adds  r0, r0, r5
    lsls  r1, r1, #9
    lsrs  r1, r1, #2
    adds  r1, r1, r5
    movs  r6, r1
    lsrs  r1, r3
    cmp   r3, #7
    bls   3f
    movs  r5, r1                // the lowest bit stands for all that went
    lsls  r5, r3
    cmp   r5, r6
    beq   3f
    movs  r5, #1
    orrs  r1, r5
3:  cmp   r4, #0
    bmi   10f
    adds  r0, r0, r1
    bpl   5f
    lsls  r2, r2, #23           // a carry: one bit more goes
    lsrs  r1, r0, #8
    bcc   6f
    lsls  r3, r0, #25
4:  bne   12f
    lsrs  r3, r1, #1            // a tie: to even
    bcc   6f
12: adds  r1, #1
    adds  r0, r1, r2
    pop   {{r4, r5, r6, pc}}
5:  subs  r2, #1
    lsls  r2, r2, #23
    lsrs  r1, r0, #7
    bcc   6f
    lsls  r3, r0, #26
    b     4b
6:  adds  r0, r1, r2
7:  pop   {{r4, r5, r6, pc}}
8:  cmp   r2, #0                // a number and zero
    beq   9f
    lsls  r3, r1, #1
    beq   7b
9:  bl    imucal_any_sum
    pop   {{r4, r5, r6, pc}}
10: subs  r0, r0, r1
    beq   7b
    b     13f
11: lsls  r0, r0, #1
    subs  r2, #1
13: lsls  r3, r0, #1
    bpl   11b
    b     5b
    .size __aeabi_fadd, . - __aeabi_fadd
    .size __aeabi_fsub, . - __aeabi_fsub
    .text
    "
);
