; pressing a button swaps every lamp that is wired to it: two conditional effects that cross
(define (domain switchboard)
  (:requirements :adl)
  (:types lamp button)
  (:predicates (lit ?l - lamp) (wired ?b - button ?l - lamp))
  (:action press
    :parameters (?b - button)
    :precondition ()
    :effect (forall (?l - lamp)
              (and (when (and (wired ?b ?l) (lit ?l)) (not (lit ?l)))
                   (when (and (wired ?b ?l) (not (lit ?l))) (lit ?l))))))
