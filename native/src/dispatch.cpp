// Which of the compiled levels this machine runs.
#include <cstring>

#include "kernels.h"
#include "refine_kernels.h"

namespace bearcub {
namespace {

bool wanted(const char* level, const char* name) {
    return level == nullptr || std::strcmp(level, name) == 0;
}

}  // namespace

#define BEARCUB_DECLARE(level)                \
    namespace level {                         \
    extern const Kernels table;               \
    extern const RefineKernels refine_table;  \
    }

#if defined(__x86_64__)

BEARCUB_DECLARE(avx512)
BEARCUB_DECLARE(avx2)
BEARCUB_DECLARE(sse41)

// The best first. A level is asked for what its compiler's flags allow, see CMakeLists.txt.
#define BEARCUB_CHOOSE(table)                                                           \
    if (wanted(level, "avx512") && __builtin_cpu_supports("avx512bw") &&                \
        __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&     \
        __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512vbmi") &&   \
        __builtin_cpu_supports("avx512bitalg")) {                                       \
        return &avx512::table;                                                          \
    }                                                                                   \
    if (wanted(level, "avx2") && __builtin_cpu_supports("avx2") &&                      \
        __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2") &&              \
        __builtin_cpu_supports("fma")) {                                                \
        return &avx2::table;                                                            \
    }                                                                                   \
    if (wanted(level, "sse41") && __builtin_cpu_supports("sse4.1")) return &sse41::table; \
    return nullptr

#else

BEARCUB_DECLARE(neon)

// Every aarch64 has it.
#define BEARCUB_CHOOSE(table) return wanted(level, "neon") ? &neon::table : nullptr

#endif

const Kernels* kernels(const char* level) { BEARCUB_CHOOSE(table); }

const RefineKernels* refine_kernels(const char* level) { BEARCUB_CHOOSE(refine_table); }

}  // namespace bearcub
