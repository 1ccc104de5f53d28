#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <ros/service_traits.h>

#include <algorithm>
#include <boost/shared_ptr.hpp>
#include <cstdint>
#include <vector>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

/// A message that takes no more memory than its bytes have elements. Where a message says how long
/// an array is, roscpp makes room for that many elements before it looks whether they are there:
/// twenty bytes could take all memory. In place of `Message`, this is read from the same bytes by
/// subscribers, services and bags.
template <typename Message>
struct Bounded {
  Message message;
  bool is_whole = true;  ///< false: something in it goes beyond its end, and the rest is missing
};

/// The message in it. Throws Error if it is not whole.
template <typename Message>
const Message& whole(const Bounded<Message>& bounded) {
  if (!bounded.is_whole) throw Error("the message is truncated");
  return bounded.message;
}

/// Likewise one that is shared; null if there is none.
template <typename Message>
boost::shared_ptr<Message> whole(const boost::shared_ptr<Bounded<Message>>& bounded) {
  if (!bounded) return nullptr;
  whole(*bounded);
  return boost::shared_ptr<Message>(bounded, &bounded->message);
}

/// Reads what ros::serialization::IStream reads, but for arrays that go beyond its end.
class BoundedStream : public ros::serialization::Stream {
 public:
  static const ros::serialization::StreamType stream_type = ros::serialization::stream_types::Input;

  BoundedStream(std::uint8_t* bytes, std::uint32_t size) : Stream(bytes, size) {}

  template <typename Value>
  void next(Value& value) {
    ros::serialization::deserialize(*this, value);
  }
  template <typename Element, typename Allocator>
  void next(std::vector<Element, Allocator>& elements) {
    BoundedStream ahead(getData(), getLength());
    std::uint32_t length = 0;
    ahead.next(length);
    // As it is made, an element has no letters and no elements: none is shorter.
    const std::uint64_t shortest = std::max(1U, ros::serialization::serializationLength(Element()));
    if (shortest * length > ahead.getLength()) ros::serialization::throwStreamOverrun();
    ros::serialization::deserialize(*this, elements);
  }
};

}  // namespace pf_resampling

namespace ros {
namespace message_traits {

template <typename Message>
struct IsMessage<pf_resampling::Bounded<Message>> : TrueType {};
template <typename Message>
struct HasHeader<pf_resampling::Bounded<Message>> : HasHeader<Message> {};
template <typename Message>
struct MD5Sum<pf_resampling::Bounded<Message>> : MD5Sum<Message> {};
template <typename Message>
struct DataType<pf_resampling::Bounded<Message>> : DataType<Message> {};
template <typename Message>
struct Definition<pf_resampling::Bounded<Message>> : Definition<Message> {};

}  // namespace message_traits

namespace service_traits {

template <typename Request>
struct MD5Sum<pf_resampling::Bounded<Request>> : MD5Sum<Request> {};
template <typename Request>
struct DataType<pf_resampling::Bounded<Request>> : DataType<Request> {};

}  // namespace service_traits

namespace serialization {

template <typename Message>
struct Serializer<pf_resampling::Bounded<Message>> {
  template <typename Stream>
  static void read(Stream& stream, pf_resampling::Bounded<Message>& bounded) {
    pf_resampling::BoundedStream rest(stream.getData(), stream.getLength());
    try {
      rest.next(bounded.message);
      stream.advance(stream.getLength() - rest.getLength());
    } catch (const StreamOverrunException&) {
      bounded.is_whole = false;
      stream.advance(stream.getLength());
    }
  }
};

}  // namespace serialization
}  // namespace ros
