#pragma once

namespace pf_resampling {

enum class LogLevel { info, warning, error };

}  // namespace pf_resampling
