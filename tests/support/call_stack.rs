//! The deepest stack of an image by analysis: frames read from the code of each function, summed along its calls.
//!
//! What a frame takes is read from the instructions that move the stack pointer down (ARMv7-M and ARMv6-M Architecture
//! Reference Manuals, A5 and A6): all of them are counted, even where only some run. Calls are `BL`, and branches to
//! the start of another function. A call through a register is not followed, but named.

use std::collections::{BTreeMap, HashMap};

use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};

/// The deepest chain of calls.
#[derive(Clone, Debug, Default)]
pub struct Depth {
    /// Its stack, bytes.
    pub bytes: u32,
    /// Functions on the way down, the root first, with their frames.
    pub chain: Vec<(String, u32)>,
}

#[derive(Clone, Debug, Default)]
struct Function {
    name: String,
    frame: u32,
    calls: Vec<u64>,
    /// Calls through a register.
    indirect: usize,
}

/// What the functions of an image take and call.
#[derive(Clone, Debug)]
pub struct CallGraph {
    functions: BTreeMap<u64, Function>,
}

impl CallGraph {
    /// Of an ELF file.
    ///
    /// # Panics
    ///
    /// Where it is none.
    pub fn of(elf: &[u8]) -> Self {
        let file = object::File::parse(elf).expect("an ELF file");
        let text = file.section_by_name(".text").expect("there is code");
        let mut functions = BTreeMap::new();
        for symbol in file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.size() > 0) {
            let start = symbol.address() & !1;
            if let Some(code) = text.data_range(start, symbol.size()).ok().flatten() {
                let name = symbol.name().unwrap_or_default().to_owned();
                functions.insert(start, Function { name, ..read(start, code) });
            }
        }
        // Only where a function starts is a branch a call.
        let starts: Vec<u64> = functions.keys().copied().collect();
        for (own, function) in &mut functions {
            function.calls.retain(|call| call != own && starts.binary_search(call).is_ok());
        }
        Self { functions }
    }

    /// Names of functions that call through a register.
    pub fn indirect(&self) -> Vec<&str> {
        self.functions.values().filter(|f| f.indirect > 0).map(|f| f.name.as_str()).collect()
    }

    /// The deepest chain from a function on.
    ///
    /// # Panics
    ///
    /// Without such a function, or where functions call each other in a circle: then there is no bound.
    pub fn depth(&self, root: &str) -> Depth {
        let named = |of: &dyn Fn(&str) -> bool| self.functions.iter().find(|(_, f)| of(&f.name));
        let start = named(&|name| name == root).or_else(|| named(&|name| name.contains(root)));
        let start = start.expect("the root").0;
        self.deepest(*start, &mut Vec::new(), &mut HashMap::new())
    }

    fn deepest(&self, at: u64, path: &mut Vec<u64>, known: &mut HashMap<u64, Depth>) -> Depth {
        if let Some(depth) = known.get(&at) {
            return depth.clone();
        }
        let function = &self.functions[&at];
        assert!(!path.contains(&at), "{} calls itself", function.name);
        path.push(at);
        let below = function.calls.iter().map(|call| self.deepest(*call, path, known));
        let below = below.max_by_key(|depth| depth.bytes).unwrap_or_default();
        path.pop();
        let mut chain = vec![(function.name.clone(), function.frame)];
        chain.extend(below.chain);
        let depth = Depth { bytes: function.frame + below.bytes, chain };
        known.insert(at, depth.clone());
        depth
    }
}

impl Function {
    /// Takes up an instruction of two bytes at an address; `numbers` are those that lie in registers.
    fn read_half(&mut self, first: u32, here: u64, (start, code): (u64, &[u8]), numbers: &mut [u32; 16]) {
        match first {
            // push
            _ if first & 0xFE00 == 0xB400 => self.frame += 4 * (first & 0x1FF).count_ones(),
            // sub sp, #n
            _ if first & 0xFF80 == 0xB080 => self.frame += 4 * (first & 0x7F),
            // add sp, rm
            _ if first & 0xFF87 == 0x4485 => {
                let number = numbers[(first >> 3 & 15) as usize] as i32;
                self.frame += number.min(0).unsigned_abs();
            }
            // ldr rt, [pc, #n]
            _ if first & 0xF800 == 0x4800 => {
                let place = ((here + 4) & !3) - start + u64::from(4 * (first & 0xFF));
                let number = code.get(place as usize..).and_then(|rest| rest.first_chunk::<4>());
                numbers[(first >> 8 & 7) as usize] = number.map_or(0, |bytes| u32::from_le_bytes(*bytes));
            }
            // blx rm
            _ if first & 0xFF87 == 0x4780 => self.indirect += 1,
            // b
            _ if first & 0xF800 == 0xE000 => {
                let offset = ((first & 0x7FF) << 21) as i32 >> 20;
                self.calls.push((here + 4).wrapping_add_signed(offset.into()));
            }
            _ => {}
        }
    }
}

/// Frame and calls of the code at an address.
fn read(start: u64, code: &[u8]) -> Function {
    let half = |at: usize| code.get(at..at + 2).map(|b| u32::from(u16::from_le_bytes([b[0], b[1]])));
    let mut function = Function::default();
    // Numbers that lie in registers: a small core moves its stack pointer by them.
    let mut numbers = [0u32; 16];
    let mut at = 0;
    while let Some(first) = half(at) {
        let here = start + at as u64;
        if first >> 11 < 0b11101 {
            at += 2;
            function.read_half(first, here, (start, code), &mut numbers);
            continue;
        }
        let Some(second) = half(at + 2) else { break };
        at += 4;
        match (first, second) {
            // push.w, vpush
            (0xE92D, _) => function.frame += 4 * second.count_ones(),
            _ if first & 0xFFBF == 0xED2D => function.frame += 4 * (second & 0xFF),
            // str rt, [sp, #-4]!
            (0xF84D, _) if second & 0xFFF == 0xD04 => function.frame += 4,
            // sub.w sp, sp, #n; subw sp, sp, #n
            _ if first & 0xFBEF == 0xF1AD && second & 0x8F00 == 0x0D00 => {
                function.frame += expand(first >> 10 & 1, second >> 12 & 7, second & 0xFF);
            }
            _ if first & 0xFBFF == 0xF2AD && second & 0x8F00 == 0x0D00 => {
                function.frame += (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xFF;
            }
            // bl, b.w
            _ if first >> 11 == 0b11110 && second & 0x9000 == 0x9000 => {
                let sign = first >> 10 & 1;
                let (i1, i2) = (1 ^ (second >> 13 & 1) ^ sign, 1 ^ (second >> 11 & 1) ^ sign);
                let bits = sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3FF) << 12 | (second & 0x7FF) << 1;
                let offset = ((bits << 7) as i32) >> 7;
                function.calls.push((here + 4).wrapping_add_signed(offset.into()));
            }
            _ => {}
        }
    }
    function
}

/// The constant of a modified immediate.
fn expand(i: u32, three: u32, eight: u32) -> u32 {
    let rotation = i << 4 | three << 1 | eight >> 7;
    match (i, three) {
        (0, 0) => eight,
        (0, 1) => eight << 16 | eight,
        (0, 2) => eight << 24 | eight << 8,
        (0, 3) => eight * 0x0101_0101,
        _ => (0x80 | eight & 0x7F).rotate_right(rotation),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_and_calls_are_read_from_the_code() {
        let code: Vec<u8> = [
            0xB5F0u16, // push {r4-r7, lr}: 20
            0xB082,    // sub sp, #8
            0xF5AD, 0x7D16, // sub.w sp, sp, #600
            0xED2D, 0x8B04, // vpush {d8, d9}: 16
            0xF000, 0xF801, // bl +2: to 0x1012
            0x4790, // blx r2
        ]
        .iter()
        .flat_map(|half| half.to_le_bytes())
        .collect();
        let function = read(0x1000, &code);
        assert_eq!((function.frame, function.indirect), (20 + 8 + 600 + 16, 1));
        assert_eq!(function.calls, [0x1000 + 12 + 4 + 2]);
        // ldr r4, [pc, #0]; add sp, r4; the number −512 behind them.
        let small: Vec<u8> =
            [0x4C00u16, 0x44A5, 0xFE00, 0xFFFF].iter().flat_map(|half| half.to_le_bytes()).collect();
        assert_eq!(read(0x1000, &small).frame, 512);
    }
}
