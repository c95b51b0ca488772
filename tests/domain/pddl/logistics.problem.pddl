(define (problem one-package)
  (:domain logistics)
  (:objects p1 - package t1 t2 - truck a1 - airplane
            post1 - location air1 air2 - airport c1 c2 - city)
  (:init (in-city post1 c1) (in-city air1 c1) (in-city air2 c2)
         (at p1 post1) (at t1 air1) (at t2 air2) (at a1 air2))
  (:goal (at p1 air2)))
