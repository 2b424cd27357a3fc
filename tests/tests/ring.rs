//! The firmware's queue between interrupt and background, on the desktop: it never waits, and when it is full the newest
//! element is refused, not the oldest lost.

#[allow(dead_code, reason = "the firmware uses what these tests do not")]
#[path = "../../firmware/src/ring.rs"]
mod ring;

use ring::Ring;

fn leaked<T, const N: usize>() -> &'static mut Ring<T, N> {
    Box::leak(Box::new(Ring::new()))
}

#[test]
fn a_queue_that_nobody_empties_refuses_what_does_not_fit_and_keeps_what_it_has() {
    let (mut writer, mut reader) = leaked::<u32, 32>().split();
    let refused: Vec<u32> = (0..1000).filter_map(|n| writer.enqueue(n).err()).collect();
    assert_eq!(refused, (32..1000).collect::<Vec<_>>());
    let kept: Vec<u32> = std::iter::from_fn(|| reader.dequeue()).collect();
    assert_eq!(kept, (0..32).collect::<Vec<_>>());
    assert!(writer.enqueue(7).is_ok() && !writer.is_empty());
}

#[test]
fn two_threads_lose_and_reorder_nothing_that_was_accepted() {
    let (mut writer, mut reader) = leaked::<u64, 256>().split();
    const COUNT: u64 = 10_000;
    let interrupt = std::thread::spawn(move || {
        for n in 0..COUNT {
            let mut element = n;
            while let Err(back) = writer.enqueue(element) {
                element = back;
                std::thread::yield_now();
            }
        }
    });
    let mut next = 0;
    while next < COUNT {
        match reader.dequeue() {
            Some(element) => {
                assert_eq!(element, next);
                next += 1;
            }
            None => std::thread::yield_now(),
        }
    }
    interrupt.join().expect("writer");
}

#[test]
fn an_element_looked_at_in_place_is_dropped_once() {
    let (mut writer, mut reader) = leaked::<std::rc::Rc<()>, 2>().split();
    let element = std::rc::Rc::new(());
    assert!(writer.enqueue(element.clone()).is_ok());
    reader.dequeue_with(|inside| assert_eq!(std::rc::Rc::strong_count(inside), 2));
    assert_eq!(std::rc::Rc::strong_count(&element), 1);
    reader.dequeue_with(|_| panic!("the queue is empty"));
}
