// Compiles fmt and toml++ into the FMU's library, since Debian has them only as shared objects: an
// FMU depends on libc and libm alone.
#include <fmt/format-inl.h>

#define TOML_IMPLEMENTATION
#include <toml++/toml.h>

FMT_BEGIN_NAMESPACE
namespace detail {
template FMT_API dragonbox::decimal_fp<float> dragonbox::to_decimal(float) noexcept;
template FMT_API dragonbox::decimal_fp<double> dragonbox::to_decimal(double) noexcept;
template FMT_API std::locale locale_ref::get<std::locale>() const;
template FMT_API thousands_sep_result<char> thousands_sep_impl(locale_ref);
template FMT_API char decimal_point_impl(locale_ref);
}  // namespace detail
FMT_END_NAMESPACE
