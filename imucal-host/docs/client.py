"""A host of imucal's co-processor, written from protocol.md: `python3 client.py HOST PORT RECORD`. No key, no fit."""
import secrets, socket, struct, sys, time, zlib

def cobs(plain):
    out = b""
    for run in plain.split(b"\0"):
        while len(run) >= 254:
            out, run = out + b"\xff" + run[:254], run[254:]
        out += bytes([len(run) + 1]) + run
    return out + b"\0"

def plain_of(rest):
    out = b""
    while rest:
        code, block, rest = rest[0], rest[1:rest[0]], rest[rest[0]:]
        out += block + (b"\0" if code < 255 and rest else b"")
    return out

def frame(id, session, message):
    plain = struct.pack("<BIBI", 2, id, 0, session) + message
    return cobs(plain + struct.pack("<I", zlib.crc32(plain)))

def varint(number):
    return bytes([number]) if number < 128 else bytes([number & 127 | 128]) + varint(number >> 7)

def take(message, at=0):  # a varint, and where the next field begins
    high, end = take(message, at + 1) if message[at] > 127 else (0, at + 1)
    return message[at] & 127 | high << 7, end

class Device:
    def __init__(self, host, port):
        self.line, self.bytes, self.session, self.id = socket.create_connection((host, port)), b"", 0, 0
        self.line.sendall(b"\0")
        nonce = secrets.randbits(64)
        identity = self.ask(0, varint(nonce))
        name = take(identity)
        serial = take(identity, sum(name))
        self.name, self.serial = (identity[at:at + length].decode() for length, at in (name, serial))
        device = take(identity, sum(serial) + 5)[0]  # behind firmware and record version
        self.session, self.id = zlib.crc32(struct.pack("<QQ", nonce, device)), 0

    def ask(self, request, fields=b"", patience=3.0):
        for _ in range(3):
            self.id += 1
            self.line.sendall(frame(self.id, self.session, bytes([request]) + fields))
            reply = self.answer(time.monotonic() + patience)
            if reply and reply[:2] == b"\x09\x04":  # stale: go on above the last id taken
                self.id = max(self.id, take(reply, 2)[0])
            elif reply and reply[0] == 9:
                raise RuntimeError(f"refused: fault {reply[1]}")
            elif reply:
                return reply[1:]
        raise TimeoutError("no answer")

    def answer(self, end):
        while (left := end - time.monotonic()) > 0:
            whole, zero, rest = self.bytes.partition(b"\0")
            if not zero:
                self.line.settimeout(left)
                try:
                    self.bytes += self.line.recv(1024)
                except TimeoutError:
                    return None
                continue
            self.bytes, plain = rest, plain_of(whole)
            if len(plain) < 12 or zlib.crc32(plain[:-4]) != int.from_bytes(plain[-4:], "little"):
                continue
            version, id, flags, session = struct.unpack_from("<BIBI", plain)
            if (version, id) == (1, self.id) and plain[5:7] == b"\x09\x02":
                raise RuntimeError(f"refused: it speaks version {plain[7]}")
            if version == 2 and flags == 1 and id == self.id and self.session in (0, session):
                return plain[10:-4]
            if version == 2 and flags == 1 and id == 0 and self.session:
                return None  # this request was damaged on its way

if __name__ == "__main__":
    device, record = Device(sys.argv[1], int(sys.argv[2])), open(sys.argv[3], "rb").read()
    print(f"{device.name}, serial {device.serial}")
    print("stored as record", take(device.ask(3, varint(len(record)) + record + b"\0", 10.0))[0])
    print("given back", "alike" if device.ask(2) == varint(len(record)) + record else "DIFFERENT")
    sample = struct.pack("<BfB3f", 0, 31.0, 1, 33000.0, 32000.0, 31000.0)
    print("corrected", device.ask(4, sample)[1:].hex())
