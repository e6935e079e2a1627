// Which of the compiled levels this machine runs.
#include "levels.h"

#include <stdexcept>

namespace bearcub {

#define BEARCUB_DECLARE(name)                                                               \
    namespace name {                                                                        \
    extern const Kernels kernels;                                                           \
    extern const GateKernels gate_kernels;                                                  \
    extern const RefineKernels refine_kernels;                                              \
    extern const RectifyKernels rectify_kernels;                                            \
    extern const LookKernels look_kernels;                                                  \
    const Level level{#name,           &kernels,         &gate_kernels,                     \
                      &refine_kernels, &rectify_kernels, &look_kernels};                    \
    }

#if defined(__x86_64__)

BEARCUB_DECLARE(avx512)
BEARCUB_DECLARE(avx2)
BEARCUB_DECLARE(sse41)

// A level is asked for what its compiler's flags allow, see CMakeLists.txt.
std::vector<Level> levels() {
    const bool runs_sse41 = __builtin_cpu_supports("sse4.1");
    const bool runs_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
                           __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("fma");
    const bool runs_avx512 =
        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512vbmi") && __builtin_cpu_supports("avx512bitalg");
    std::vector<Level> found;
    if (runs_avx512) found.push_back(avx512::level);
    if (runs_avx2) found.push_back(avx2::level);
    if (runs_sse41) found.push_back(sse41::level);
    return found;
}

#else

BEARCUB_DECLARE(neon)

// Every aarch64 has it.
std::vector<Level> levels() { return {neon::level}; }

#endif

Level level_of(const std::optional<std::string>& name) {
    for (const Level& level : levels()) {
        if (!name || *name == level.name) return level;
    }
    throw std::invalid_argument("this machine does not run " + name.value_or("any level"));
}

}  // namespace bearcub
