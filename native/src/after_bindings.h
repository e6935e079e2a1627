// The kernels that follow disparity, as Python sees them.
#pragma once

#include <nanobind/nanobind.h>

namespace bearcub {

void bind_after(nanobind::module_& m);

}  // namespace bearcub
