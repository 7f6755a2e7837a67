//! Sections of options that the command line, a configuration and other shells share.

/// Declares a section of options: a struct that serde fills from a table of a configuration and, with the
/// feature `clap`, clap from the command line. Every option may be left out of either. A field's comment is
/// the option's help.
macro_rules! section {
    (
        $(#[doc = $story:literal])*
        pub struct $name:ident {
            $(
                $(#[doc = $help:literal])*
                #[arg($($argument:tt)*)]
                pub $field:ident: $kind:ty,
            )*
        }
    ) => {
        $(#[doc = $story])*
        #[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
        #[cfg_attr(feature = "clap", derive(clap::Args))]
        #[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
        pub struct $name {
            $(
                $(#[doc = $help])*
                #[cfg_attr(feature = "clap", arg($($argument)*))]
                #[serde(skip_serializing_if = "Option::is_none")]
                pub $field: Option<$kind>,
            )*
        }

        impl $name {
            /// The options' names, as fields of this struct.
            pub const NAMES: &[&str] = &[$(stringify!($field)),*];

            /// Takes from `other` what was not given.
            pub fn or(self, other: Self) -> Self {
                Self { $($field: self.$field.or(other.$field),)* }
            }

            /// Whether no option was given.
            pub fn is_empty(&self) -> bool {
                *self == Self::default()
            }
        }
    };
}
pub(crate) use section;
