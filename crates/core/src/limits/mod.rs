pub mod margins;
