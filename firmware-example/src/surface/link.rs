//! Frames, messages, sessions and seals.

use imucal_core::{
    link::{
        self, Asked, CaptureSensor, CaptureTask, FitModel, Frame, Guard, Header, MAX_FRAME, Nonces, Origin,
        RawSample, Receiver, Reply, Request, Seal,
    },
    observation::BlockBuilder,
    record::{RawUnit, Sensor},
    session::Session,
};

const NONCES: Nonces = Nonces { host: 1, device: 2 };

#[inline(never)]
pub(super) fn reach_all() {
    fits();
    captures();
    frames();
    let mut guard = reach!(link::Guard::new(None, 7));
    asked(&mut guard, &Request::Identify { nonce: 1 }, None);
    asked(&mut guard, &Request::Status, None);
    #[cfg(feature = "key")]
    seals();
}

#[inline(never)]
fn fits() {
    for model in FitModel::ALL {
        reach!(link::FitModel::sensor(model));
        reach!(link::FitModel::name(model));
    }
    let (block, duration) = BlockBuilder::default().finish();
    reach!(link::Observation::block(&block, duration));
}

/// A session by its messages.
#[inline(never)]
fn captures() {
    let sensor = CaptureSensor {
        target: 0.01,
        full_scale: 100.0,
        unit_in: RawUnit::Counts,
        offset: 0.0,
        per_unit: 100.0,
    };
    let task = CaptureTask { gravity: 9.8, field: None, field_down: None, hold: 2.0, sensors: [sensor; 3] };
    let Some(settings) = reach!(link::CaptureTask::settings(&task)) else { return };
    reach!(link::CaptureSensor::nominal(&sensor, [1.0; 3]));
    reach!(link::CaptureSensor::units(&sensor, Sensor::Gyroscope));
    let mut session: Session<8, 2, 16> = Session::new(settings);
    let sample = RawSample { time: 0, raw: [Some([1.0; 3]); 3], temperature: 25.0 };
    reach!(link::CaptureTask::push(&task, &mut session, &sample));
}

/// What a device that cannot read a frame says.
#[inline(never)]
fn frames() {
    let mut buffer = [0; MAX_FRAME];
    let refusal = reach!(link::refuse_version(7, &mut buffer));
    let mut receiver: Receiver = reach!(link::Receiver::default());
    for byte in refusal {
        if let Some(Ok(plain)) = reach!(link::Receiver::push(&mut receiver, *byte)) {
            let _frame = reach!(link::split(plain));
        }
    }
}

/// One request, and what its guard says of it.
#[inline(never)]
fn asked(guard: &mut Guard<'_>, request: &Request<'_>, seal: Option<Seal<'_>>) {
    reach!(link::Request::changes(request));
    let header = Header { id: 1, origin: Origin::Host, session: reach!(link::Nonces::session(&NONCES)) };
    let (mut buffer, mut plain) = ([0; MAX_FRAME], [0; MAX_FRAME]);
    let Ok(bytes) = reach!(link::encode(&header, request, seal, &mut buffer)) else { return };
    let length = decoded(bytes, &mut plain);
    let Some(Ok(frame)) = plain.get(..length).map(link::split) else { return };
    if let Some(seal) = &seal {
        reach!(link::Frame::is_sealed_by(&frame, seal));
    }
    let _reply: Result<Reply<'_>, _> = reach!(link::Frame::read(&frame));
    let request: Result<Request<'_>, _> = reach!(link::Frame::read(&frame));
    if let Ok(request) = request {
        admitted(guard, &frame, &request);
    }
}

/// A frame without its COBS; its length.
#[inline(never)]
fn decoded(bytes: &[u8], plain: &mut [u8; MAX_FRAME]) -> usize {
    let mut receiver = Receiver::default();
    let mut length = 0;
    for byte in bytes {
        if let Some(Ok(frame)) = receiver.push(*byte) {
            plain.iter_mut().zip(frame).for_each(|(slot, byte)| *slot = *byte);
            length = frame.len();
        }
    }
    length
}

#[inline(never)]
fn admitted(guard: &mut Guard<'_>, frame: &Frame<'_>, request: &Request<'_>) {
    let refused = reach!(link::Asked::by(&frame.header));
    reach!(link::Guard::is_for_us(guard, frame));
    let asked: Asked = reach!(link::Guard::admit(guard, frame, request)).unwrap_or(refused);
    reach!(link::Header::answer(&asked));
    reach!(link::Guard::nonce(guard));
    reach!(link::Guard::seal_for(guard, &asked));
    reach!(link::Guard::is_current(guard, &asked));
    reach!(link::Guard::may_complain(guard));
    reach!(link::Guard::is_keyed(guard));
    reach!(link::Guard::is_locked(guard));
}

#[cfg(feature = "key")]
#[inline(never)]
fn seals() {
    use imucal_core::link::Key;

    let key: Key = reach!(link::Key::new([7; 32]));
    let _key: Option<Key> = reach!(link::Key::from_hex("07"));
    let seal = Seal { key: &key, nonces: NONCES };
    let made = reach!(link::Seal::of(&seal, &[1, 2, 3]));
    reach!(link::Seal::is_of(&seal, &[1, 2, 3], &made));
    let mut guard = Guard::new(Some(&key), 7);
    asked(&mut guard, &Request::Identify { nonce: 1 }, None);
    asked(&mut guard, &Request::Lock, Some(seal));
}
