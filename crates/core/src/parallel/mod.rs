pub mod streaming_stores;
pub mod threads;
