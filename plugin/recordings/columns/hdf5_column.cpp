// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/hdf5_column.h"

#include <fmt/format.h>

#include <utility>

namespace efm {

Hdf5Column::Type Hdf5Column::typeOf(const Hdf5Rows& rows, hid_t type) {
  const H5T_class_t kind = H5Tget_class(type);
  if (kind == H5T_ENUM) {  // h5py's bool
    const Hdf5Id super(H5Tget_super(type), H5Tclose);
    return typeOf(rows, super.get());
  }
  const std::size_t bytes = H5Tget_size(type);
  const bool little = bytes == 1 || H5Tget_order(type) == H5T_ORDER_LE;
  if (kind == H5T_FLOAT && little && bytes == sizeof(float)) return Type::kFloat;
  if (kind == H5T_FLOAT && little && bytes == sizeof(double)) return Type::kDouble;
  if (kind == H5T_INTEGER && little) {
    const bool has_sign = H5Tget_sign(type) == H5T_SGN_2;
    switch (bytes) {
      case 1:
        return has_sign ? Type::kInt8 : Type::kUint8;
      case 2:
        return has_sign ? Type::kInt16 : Type::kUint16;
      case 4:
        return has_sign ? Type::kInt32 : Type::kUint32;
      case 8:
        return has_sign ? Type::kInt64 : Type::kUint64;
      default:
        break;
    }
  }
  throw rows.fail("expected whole numbers of 1, 2, 4 or 8 bytes, float or double, little-endian");
}

Hdf5Column Hdf5Column::ofMatrix(std::shared_ptr<Hdf5Rows> rows, std::size_t index) {
  if (index >= rows->rowNumbers()) {
    throw rows->fail(fmt::format("{} columns: expected {} or more", rows->rowNumbers(), index + 1));
  }
  const Type type = typeOf(*rows, rows->type());
  const std::size_t offset = index * (rows->rowBytes() / rows->rowNumbers());
  return {std::move(rows), offset, type};
}

Hdf5Column Hdf5Column::ofField(std::shared_ptr<Hdf5Rows> rows, const std::string& field) {
  const Hdf5Quiet quiet;
  const bool is_compound = H5Tget_class(rows->type()) == H5T_COMPOUND && rows->rowNumbers() == 1;
  const int index = is_compound ? H5Tget_member_index(rows->type(), field.c_str()) : -1;
  if (index < 0) throw rows->fail("expected a list of compound values with a field " + field);
  const auto member = static_cast<unsigned>(index);
  const Hdf5Id member_type(H5Tget_member_type(rows->type(), member), H5Tclose);
  const Type type = typeOf(*rows, member_type.get());
  const std::size_t offset = H5Tget_member_offset(rows->type(), member);
  return {std::move(rows), offset, type};
}

}  // namespace efm
