//! What each kind of room holds, and how often.

use crate::training::plan::Use;

/// What a room may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Piece {
    Sofa,
    OldSofa,
    Armchair,
    Shelf,
    Bookcase,
    Rack,
    Wardrobe,
    Cupboard,
    Sideboard,
    Workplace,
    Bed,
    KitchenRow,
    Fridge,
    Washer,
    Media,
    WallTable,
    Dining,
    LowTable,
    MiddleBench,
    Basin,
    Toilet,
    Tub,
    Plant,
    FloorLamp,
    Thin,
    Drying,
    Column,
    Chair,
}

use Piece::*;

impl Piece {
    /// Whether a room has one of it at most.
    pub fn comes_once(self) -> bool {
        matches!(
            self,
            Bed | Fridge | Washer | Media | Basin | Toilet | Tub | Drying
        )
    }
}

/// Pieces for a room, with weights; the first makes it what it is.
pub(crate) fn wishes(usage: Use) -> &'static [(Piece, u32)] {
    match usage {
        Use::Living => &[
            (Sofa, 20),
            (OldSofa, 6),
            (Armchair, 8),
            (Shelf, 12),
            (Bookcase, 6),
            (Media, 10),
            (Sideboard, 5),
            (Cupboard, 8),
            (LowTable, 12),
            (Plant, 8),
            (FloorLamp, 8),
            (Dining, 6),
            (Thin, 2),
            (Column, 2),
        ],
        Use::Bedroom => &[
            (Bed, 30),
            (Wardrobe, 18),
            (Cupboard, 12),
            (Shelf, 7),
            (Workplace, 7),
            (Armchair, 4),
            (FloorLamp, 6),
            (Chair, 6),
            (Plant, 4),
            (Drying, 3),
            (Thin, 3),
            (Media, 3),
        ],
        Use::Kitchen => &[
            (KitchenRow, 40),
            (Fridge, 14),
            (Dining, 16),
            (MiddleBench, 8),
            (Shelf, 6),
            (Washer, 5),
            (Cupboard, 5),
            (Chair, 4),
            (Plant, 3),
            (Column, 1),
        ],
        Use::Dining => &[
            (Dining, 40),
            (Sideboard, 10),
            (Cupboard, 12),
            (Shelf, 8),
            (Plant, 8),
            (FloorLamp, 5),
            (WallTable, 6),
            (Column, 4),
            (Chair, 5),
        ],
        Use::Office => &[
            (Workplace, 40),
            (Shelf, 16),
            (Rack, 6),
            (Cupboard, 10),
            (Dining, 7),
            (Chair, 6),
            (Plant, 6),
            (FloorLamp, 3),
            (Armchair, 3),
            (Column, 4),
            (MiddleBench, 4),
        ],
        Use::Store => &[
            (Rack, 34),
            (Shelf, 12),
            (Wardrobe, 6),
            (WallTable, 12),
            (Thin, 14),
            (Washer, 5),
            (Drying, 5),
            (Column, 5),
            (MiddleBench, 8),
            (Chair, 4),
        ],
        Use::Hall => &[
            (Cupboard, 20),
            (Wardrobe, 10),
            (Shelf, 10),
            (Thin, 10),
            (Plant, 8),
            (Chair, 5),
        ],
        Use::Bath => &[
            (Basin, 30),
            (Toilet, 20),
            (Tub, 24),
            (Washer, 14),
            (Cupboard, 12),
            (Drying, 8),
        ],
        Use::Bare => &[
            (Column, 12),
            (Chair, 8),
            (Thin, 10),
            (Cupboard, 6),
            (FloorLamp, 3),
        ],
    }
}
