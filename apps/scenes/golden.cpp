#include "apps/scenes/golden.hpp"

#include <throng/checksum.hpp>

namespace throng::scenes {

std::uint64_t sequence_checksum(const Pair* pairs, std::size_t count) noexcept {
  std::uint64_t state = count;
  for (std::size_t i = 0; i < count; ++i) {
    state = mix64(state ^ (std::uint64_t{pairs[i].first} << 32 | pairs[i].second));
  }
  return state;
}

// Printed by `throng bench --golden`. A different number means a different set of pairs, or a scene
// that changed under its name.
const std::vector<Golden>& golden() {
  static const std::vector<Golden> all = {
      {"uniform", 0, 1000, 554, 0xf1dd42827bd6f46a, 0x6a4aafe308cc8119},
      {"uniform", 0, 10000, 5020, 0xc8ef1177c2cddd49, 0xb76bd8576ddca0ec},
      {"uniform", 0, 100000, 49848, 0x8b99b1433e0dc89a, 0x3f1076bf0aa3e7d8},
      {"uniform", 0, 1000000, 500057, 0x896625e21317f8a2, 0xa6ef5cdd62f0aab7},
      {"pile", 0, 1000, 4913, 0x413003ef54a11cf5, 0x3a0bd7131a45a3ac},
      {"pile", 0, 10000, 48803, 0x57d82e59ec727da9, 0xf2fba4bd71d0a66a},
      {"pile", 0, 100000, 489947, 0x374b722920284b50, 0x7b7f1959ecbbafe3},
      {"pile", 0, 1000000, 4897152, 0xce0ae5d94a4f58cd, 0x2d6d727c1da95e43},
      {"column", 60, 1000, 884, 0x29c3683c3aeeb843, 0xf959632fd672c612},
      {"column", 60, 10000, 11013, 0xf8677d653d083ac8, 0xd1f956f4575a90da},
      {"column", 60, 100000, 132706, 0x8e4e3169c6e35c11, 0x342daddd33efcff4},
      {"column", 60, 1000000, 1512559, 0xe6df5f21593780af, 0x71f2e4f23df02640},
      {"spheres", 0, 1000, 971, 0x4577cd8896cc734e, 0x00989e7c51313a2f},
      {"spheres", 0, 10000, 9908, 0x9b6cd468df66d73b, 0x07478f645eaeb6bf},
      {"spheres", 0, 100000, 100527, 0xe5442a2b55e27b72, 0xcf6f88d253f3426c},
      {"spheres", 0, 1000000, 998623, 0x5a0fd1269543dbd7, 0x8317cbe707eb98a9},
      {"mixed", 0, 1000, 5011, 0x352e6cd582264643, 0x6fd6a6740a0d678f},
      {"mixed", 0, 10000, 47212, 0xd019f693976ee92e, 0x39e21fb4a61c2a42},
      {"mixed", 0, 100000, 470340, 0x69ea3f5add2f9616, 0x9b94e1377a4e201b},
      {"mixed", 0, 1000000, 4714115, 0x42ea1d14135312a3, 0x1e44c13ab431e2ed},
      {"clusters", 0, 1000, 524, 0x90b97a12314115a9, 0xefe1439d24908d28},
      {"clusters", 0, 10000, 5049, 0x801c1f2a90c9e788, 0x053bfe5544a10296},
      {"clusters", 0, 100000, 49880, 0x3181fe54d8607460, 0x60bf4b6a2f6eecbb},
      {"clusters", 0, 1000000, 499272, 0x2896a4e278c3eb61, 0x084fb846afa60116},
      {"rods", 0, 1000, 2936, 0x3e87b3140b564f69, 0x086c9b6b4ab1303a},
      {"rods", 0, 10000, 27643, 0x5a2b3aa57d0bcc48, 0x3b552048b3b3e2d8},
      {"rods", 0, 100000, 269558, 0x7cda5814134dff2c, 0x83602d058328821c},
      {"rods", 0, 1000000, 2697488, 0x7f597496ae6ecb12, 0x7e9b69a87aa4e2f3},
      {"line", 0, 1000, 1036, 0xcc093f971729b95f, 0xf364661e7113c7d6},
      {"line", 0, 10000, 10112, 0x197a8828e5990550, 0x57fc10c301196af8},
      {"line", 0, 100000, 100198, 0x05d1e54d80eaee36, 0x303a623a41337309},
      {"line", 0, 1000000, 1010136, 0xd1f297b317336daa, 0xeb250d3bb5fb6462},
      {"sparse", 0, 1000, 2, 0x70da50ac34ddd28f, 0x0a0647a80db03299},
      {"sparse", 0, 10000, 4, 0x8424f94c067e452e, 0x120f1b7b36049e5b},
      {"sparse", 0, 100000, 104, 0x3efc0a4812282f6c, 0x7dac7e5b80d6ff61},
      {"sparse", 0, 1000000, 997, 0xc668ca97229d57ab, 0x451fdffff1b5f593},
      {"worlds", 0, 1000, 481, 0x9eaa88b09e2a9716, 0x94050cdda5eef160},
      {"worlds", 0, 10000, 5032, 0x64510da1e3101594, 0xc0d816061491eb44},
      {"worlds", 0, 100000, 50336, 0x6d7fe8e86f352329, 0xb421e472be30690a},
      {"worlds", 0, 1000000, 500682, 0x553e9f23445d4047, 0x76593db9a5d34747},
      {"rods-any", 0, 1000, 38634, 0x6cd49477d7999808, 0x521ad162060129ef},
      {"rods-any", 0, 10000, 388186, 0xd89e6332e4aadfcd, 0xc8d5d761f7630234},
      {"rods-any", 0, 100000, 3889855, 0x5c88c102bc9782ba, 0x9a26deec9e9ad19c},
      {"rods-any", 0, 1000000, 38948318, 0x64ea2a367bd333f9, 0xd3e6e623b59dc9f0},
      {"rectangles", 0, 1000, 935, 0xff21dadafdadad26, 0x75e25ff2930f7063},
      {"rectangles", 0, 10000, 9715, 0x7709057d269fca2f, 0x4041a8ff05981498},
      {"rectangles", 0, 100000, 99981, 0x211fdef498f3c85e, 0xdc6376254c7647b3},
      {"rectangles", 0, 1000000, 999927, 0x71c66bc84ff7e4f7, 0x97bbef02a3bbf2b1},
      {"nbody", 0, 1000, 999, 0xee01ba79b5909f88, 0xf7d4f7430cad5c60},
      {"nbody", 0, 10000, 9999, 0x9ce54f41bc71bd2a, 0x11ae5420d13f7b07},
      {"nbody", 0, 100000, 99768, 0x3e3a272044bc7383, 0x93287c183cbafb22},
      {"nbody", 0, 1000000, 1000419, 0xa8bb4a1ac9cf2cc9, 0xc220d02286636876},
  };
  return all;
}

}  // namespace throng::scenes
