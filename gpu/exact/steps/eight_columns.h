#pragma once
// Samples held against a triangle eight at a time, on a host.
#include "gpu/exact/steps/heights.h"

namespace cordillera::gpu::exact {

/// Floats beyond the last sample of Field::height that may be read, whatever they are.
inline constexpr std::size_t kReadBeyond = 8;

/// Eight columns of samples from `west` on, in rows south to north, ends included: do those under the triangle fit? They are
/// valid and the triangle is published: what sample_fits says of each. Columns may lie beyond the row.
bool eight_columns_fit(const Triangle& t, const Field& field, int west, int south, int north);

/// The same of a square of coded samples: what coded_samples_fit says.
bool eight_coded_fit(const Triangle& t, const Field& field, int sx, int sy);
/// What coded_square_error says.
float eight_coded_error(const Triangle& t, const Field& field, int sx, int sy);

/// What PullBox::add makes of all samples of a box. No void lies under the box, and samples are not coded.
Pull eight_columns_pull(const PullBox& box, const Field& field);

}  // namespace cordillera::gpu::exact
