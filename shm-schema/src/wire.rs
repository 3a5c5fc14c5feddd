//! Fields to octets and back: little endian, no padding, total in both
//! directions. A decoder that meets an octet it does not know answers `None`.

/// Something with a fixed length in octets.
pub trait Wire: Sized {
    /// Length in octets.
    const LENGTH: usize;
    /// Digest of name, order and type of everything inside; part of the layout hash.
    const LAYOUT: u32;
    /// Appends the octets. Stops silently when `out` is full: a too short cell
    /// fails its check sum at the reader.
    fn put(&self, out: &mut Sink<'_>);
    /// Takes the octets off `from`; `None` when there are too few or a value is unknown.
    fn take(from: &mut Source<'_>) -> Option<Self>;
}

/// Octets still to be read.
#[derive(Debug)]
pub struct Source<'a>(&'a [u8]);

impl<'a> Source<'a> {
    /// Reads from the start of `octets`.
    pub const fn new(octets: &'a [u8]) -> Self {
        Self(octets)
    }

    /// The next `N` octets.
    #[inline]
    pub fn chunk<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, tail) = self.0.split_first_chunk::<N>()?;
        self.0 = tail;
        Some(*head)
    }
}

/// Octets still to be written.
#[derive(Debug)]
pub struct Sink<'a>(&'a mut [u8]);

impl<'a> Sink<'a> {
    /// Writes from the start of `octets`.
    pub const fn new(octets: &'a mut [u8]) -> Self {
        Self(octets)
    }

    /// Writes the next `N` octets, or nothing when fewer are left.
    #[inline]
    pub fn chunk<const N: usize>(&mut self, value: [u8; N]) {
        let octets = core::mem::take(&mut self.0);
        if let Some((head, tail)) = octets.split_first_chunk_mut::<N>() {
            *head = value;
            self.0 = tail;
        }
    }
}

/// FNV-1a over `text`, continued from `seed`.
pub const fn digest(seed: u32, text: &str) -> u32 {
    let octets = text.as_bytes();
    let mut hash = seed;
    let mut at = 0;
    while at < octets.len() {
        hash = (hash ^ octets[at] as u32).wrapping_mul(16_777_619);
        at += 1;
    }
    hash
}

/// Start value of [`digest`].
pub const DIGEST_START: u32 = 2_166_136_261;

/// Joins the digest of a part to the digest so far.
pub const fn join(seed: u32, part: u32) -> u32 {
    (seed.rotate_left(5) ^ part).wrapping_mul(16_777_619)
}

macro_rules! integers {
    ($($type:ty),*) => {$(
        impl Wire for $type {
            const LENGTH: usize = size_of::<$type>();
            const LAYOUT: u32 = digest(DIGEST_START, stringify!($type));
            #[inline]
            fn put(&self, out: &mut Sink<'_>) {
                out.chunk(self.to_le_bytes());
            }
            #[inline]
            fn take(from: &mut Source<'_>) -> Option<Self> {
                from.chunk().map(<$type>::from_le_bytes)
            }
        }
    )*};
}
integers!(u8, u16, u32, u64, i16, i32, i64);

/// 0 is false, 1 is true, everything else is unknown.
impl Wire for bool {
    const LENGTH: usize = 1;
    const LAYOUT: u32 = digest(DIGEST_START, "bool");
    #[inline]
    fn put(&self, out: &mut Sink<'_>) {
        u8::from(*self).put(out);
    }
    #[inline]
    fn take(from: &mut Source<'_>) -> Option<Self> {
        match u8::take(from)? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }
}

impl<T: Wire + Copy + Default, const N: usize> Wire for [T; N] {
    const LENGTH: usize = N * T::LENGTH;
    const LAYOUT: u32 = join(T::LAYOUT, N as u32);
    #[inline]
    fn put(&self, out: &mut Sink<'_>) {
        for value in self {
            value.put(out);
        }
    }
    #[inline]
    fn take(from: &mut Source<'_>) -> Option<Self> {
        let mut all = [T::default(); N];
        for value in &mut all {
            *value = T::take(from)?;
        }
        Some(all)
    }
}

/// A struct whose fields follow each other on the wire in the order written.
#[macro_export]
macro_rules! layout {
    ($(#[$meta:meta])* pub struct $name:ident { $($(#[$field_meta:meta])* pub $field:ident: $type:ty,)* }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        pub struct $name { $($(#[$field_meta])* pub $field: $type,)* }

        impl $crate::wire::Wire for $name {
            const LENGTH: usize = 0 $(+ <$type as $crate::wire::Wire>::LENGTH)*;
            const LAYOUT: u32 = {
                let mut hash = $crate::wire::digest($crate::wire::DIGEST_START, stringify!($name));
                $(
                    hash = $crate::wire::digest(hash, stringify!($field));
                    hash = $crate::wire::join(hash, <$type as $crate::wire::Wire>::LAYOUT);
                )*
                hash
            };
            #[inline]
            fn put(&self, out: &mut $crate::wire::Sink<'_>) {
                $($crate::wire::Wire::put(&self.$field, out);)*
            }
            #[inline]
            fn take(from: &mut $crate::wire::Source<'_>) -> Option<Self> {
                Some(Self { $($field: <$type as $crate::wire::Wire>::take(from)?,)* })
            }
        }
    };
}

/// An enumeration of one octet; an unknown octet is no value.
#[macro_export]
macro_rules! enumeration {
    ($(#[$meta:meta])* pub enum $name:ident { $($(#[$variant_meta:meta])* $variant:ident = $value:literal,)* }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
        #[repr(u8)]
        pub enum $name { $($(#[$variant_meta])* $variant = $value,)* }

        impl $name {
            /// The value with this octet.
            pub const fn from_octet(octet: u8) -> Option<Self> {
                match octet { $($value => Some(Self::$variant),)* _ => None }
            }
        }

        impl $crate::wire::Wire for $name {
            const LENGTH: usize = 1;
            const LAYOUT: u32 = $crate::wire::digest(
                $crate::wire::DIGEST_START,
                concat!(stringify!($name) $(, stringify!($variant), $value)*),
            );
            #[inline]
            fn put(&self, out: &mut $crate::wire::Sink<'_>) {
                (*self as u8).put(out);
            }
            #[inline]
            fn take(from: &mut $crate::wire::Source<'_>) -> Option<Self> {
                Self::from_octet(u8::take(from)?)
            }
        }
    };
}
